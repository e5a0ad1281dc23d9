"""The policies of a trial in words, tables and files: what the reports of gap studies share."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from studies.learning.outcome import record_key
from studies.reporting import Code, KeyValues, Section, Table

Results = Mapping[str, Any]

POLICY_WORDS = {
    "idealised": "idealised policy",
    "difference": "difference model, update {iteration}",
    "control": "no difference model, update {iteration}",
    "corrected": "simulator corrected by name",
    "true": "trained on the true system",
    "cold": "cold start",
    "warm": "warm start",
}


def policy_name(record: Mapping[str, Any]) -> str:
    """A policy in words."""
    return POLICY_WORDS[record["name"]].format(**record)


def load_rollout(path: Path) -> dict[str, np.ndarray]:
    """States (T + 1, n_s), actions (T, n_a) and rewards (T,) of an episode."""
    with np.load(path, allow_pickle=False) as data:
        return dict(data)


def load_rollouts(results: Results, folder: Path) -> dict[str, dict[str, np.ndarray]]:
    """The episode of every policy that left one in ``folder/rollouts``, by ``record_key``."""
    paths = {
        record_key(record): folder / "rollouts" / f"{record_key(record)}.npz"
        for record in results["policies"]
    }
    return {key: load_rollout(path) for key, path in paths.items() if path.exists()}


def last_difference(results: Results) -> Mapping[str, Any] | None:
    """The policy after the last update, if there was one."""
    learnt = [record for record in results["policies"] if record["name"] == "difference"]
    return learnt[-1] if learnt else None


def by_name(results: Results, name: str) -> list[Mapping[str, Any]]:
    """The records of one kind of policy, in order."""
    return [record for record in results["policies"] if record["name"] == name]


def accuracy_line(record: Mapping[str, Any], errors: Mapping[str, float], digits: int) -> str:
    """The one-step errors of a difference model as text for the terminal.

    Args:
        record: Of one update, as ``results.json`` has it.
        errors: By channel or group of channels.
        digits: Decimals of the errors.
    """
    text = ", ".join(f"{name} {error:.{digits}f}" for name, error in errors.items())
    return (
        f"update {record['iteration']}: one-step error where the policy goes, as a share of "
        f"the gap: {text}; fitted in {record['fit_seconds']:.1f} s"
    )


def failures_section(failures: Mapping[Path, str]) -> list[Section]:
    """The tracebacks of failed trials by folder; no section if none failed."""
    if not failures:
        return []
    text = "\n".join(f"{path}\n{failure}" for path, failure in failures.items())
    summary = f"{len(failures)} trials failed and are in no mean"
    return [Code(text, summary=summary, heading="Failed trials")]


def policies_section(results: Results) -> Table:
    """All policies."""
    return Table(
        ["policy", "true samples", "simulated steps", "return on its model", "return on the truth",
         "seconds"],
        [
            [
                policy_name(record),
                record["true_samples"],
                record["simulated_steps"],
                round(record["return_model"], 1),
                round(record["return_true"], 1),
                round(record["seconds"], 1),
            ]
            for record in results["policies"]
        ],
        digits=5,
        heading="Policies",
    )  # fmt: skip


def provenance(results: Results) -> list[Section]:
    """What made the numbers."""
    settings = io.StringIO()
    yaml.safe_dump(results["config"], settings, sort_keys=False)
    return [
        KeyValues(dict(results["versions"]), heading="Versions"),
        Code(settings.getvalue(), summary="The resolved configuration", heading="Configuration"),
    ]
