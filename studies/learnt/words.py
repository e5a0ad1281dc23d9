"""What a study left, in words: policies by name, errors by group, and what made them."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

from studies.reporting import Code, KeyValues, Section

Results = Mapping[str, Any]
Record = Mapping[str, Any]
Errors = Mapping[str, float | None]
Groups = Mapping[str, Sequence[str]]

POLICY_WORDS = {
    "idealised": "idealised policy",
    "difference": "difference model, update {iteration}",
    "control": "no difference model, update {iteration}",
    "corrected": "simulator corrected by name",
    "true": "learnt on the true system",
    "cold": "cold start",
    "warm": "warm start",
}
# The share of the way from the idealised to the true policy's return that counts as all of it.
NEAR = 0.9


def policy_name(record: Record) -> str:
    """A policy in words."""
    return POLICY_WORDS[record["name"]].format(**record)


def by_name(results: Results, name: str) -> list[Record]:
    """The records of one kind of policy, in order."""
    return [record for record in results["policies"] if record["name"] == name]


def last_difference(results: Results) -> Record | None:
    """The policy after the last update, if there was one."""
    learnt = by_name(results, "difference")
    return learnt[-1] if learnt else None


def measures_of(record: Record) -> dict[str, float]:
    """The mean of a policy's tests on the true system, by measure."""
    table = pd.DataFrame(record.get("tests", [])).drop(columns="return", errors="ignore")
    return {str(name): float(value) for name, value in table.mean().items()}


def grouped(errors: Errors, groups: Groups) -> dict[str, float]:
    """Errors by channel, averaged within each group; a channel without a gap is left out."""
    found = {}
    for name, channels in groups.items():
        values = [errors[c] for c in channels if c in errors]
        finite = [value for value in values if value is not None and np.isfinite(value)]
        if finite:
            found[name] = float(np.mean(finite))
    return found


def overall(errors: Errors, groups: Groups) -> float | None:
    """The mean over the groups; None without errors."""
    values = list(grouped(errors, groups).values())
    return float(np.mean(values)) if values else None


def accuracy_line(record: Record, groups: Groups) -> str:
    """The one-step errors of a difference model as text for the terminal."""
    errors = grouped(record["visited"]["one_step"], groups)
    text = ", ".join(f"{name} {error:.2g}" for name, error in errors.items())
    return (
        f"update {record['iteration']}: one-step error where the policy goes, as a share of "
        f"the gap: {text}; fitted in {record['fit_seconds']:.1f} s"
    )


def duration(seconds: float) -> str:
    """A time that a reader can grasp."""
    return f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.1f} min"


def failures_section(failures: Mapping[Path, str]) -> list[Section]:
    """The tracebacks of failed trials by folder; no section if none failed."""
    if not failures:
        return []
    text = "\n".join(f"{path}\n{failure}" for path, failure in failures.items())
    summary = f"{len(failures)} trials failed and are in no mean"
    return [Code(text, summary=summary, heading="Failed trials")]


def provenance(results: Results) -> list[Section]:
    """What made the numbers."""
    sections: list[Section] = []
    if "versions" in results:
        sections.append(KeyValues(dict(results["versions"]), heading="Versions"))
    if "config" in results:
        settings = io.StringIO()
        yaml.safe_dump(results["config"], settings, sort_keys=False)
        summary = "The resolved configuration"
        sections.append(Code(settings.getvalue(), summary=summary, heading="Configuration"))
    return sections
