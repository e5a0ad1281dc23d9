"""The report of find_gap: verdict first, then what it rests on."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from residual.gap import GapResult
from studies.gap.forecasts import bars, rollouts, set_aside, tiles, where
from studies.gap.verdicts import apart, banners, blind, evidence
from studies.gap.words import found_once
from studies.reporting import Code, Prose, Report, Section, Table

# Findings beyond these are in gap.json.
FINDINGS = 12


def write_report(
    result: GapResult, record: Mapping[str, Any], folder: Path, name: str = "report.html"
) -> Path:
    """Figures as PNG with their numbers as CSV, and one page, into ``folder``.

    Args:
        result: What was found.
        record: What ``gap.json`` holds.
        folder: Where to.
        name: Of the page.
    """
    figures = folder / "figures"
    sections: list[Section] = [
        *banners(result, record["config"].get("tolerance")),
        tiles(result),
        *rollouts(result, figures),
        bars(result, figures),
        *set_aside(result),
        *where(result, figures),
        evidence(result),
        *apart(result),
        *blind(result),
        *quality(result, record),
        *provenance(record),
    ]
    logs = record["config"]["logs"]
    names = ", ".join(Path(log).name for log in logs[:3])
    more = f" and {len(logs) - 3} more" if len(logs) > 3 else ""
    report = Report(
        f"Gap report: {result.corrected.name}",
        f"Where the simulator and {names}{more} disagree, and what is missing.",
        sections,
        footer(record),
    )
    return report.write(folder / name)


def quality(result: GapResult, record: Mapping[str, Any]) -> list[Section]:
    """Findings about the data, and the noise."""
    found = (((one["kind"], one["says"]), one["where"]) for one in record["quality"])
    rows = [[kind, where, says] for (kind, says), where in found_once(found)]
    noise = ", ".join(
        f"{name} {sigma:.3g} ± {error:.2g} {dict(result.channels)[name]}".strip()
        for name, (sigma, error) in result.noise.items()
    )
    text = f"Noise found (standard deviation): {noise}."
    if len(rows) > FINDINGS:
        text += f" {len(rows) - FINDINGS} more findings are in `gap.json`."
    if not rows:
        text += " Nothing else stood out in the logs."
    sections: list[Section] = [Prose(text, heading="Data quality")]
    if rows:
        sections.append(Table(["finding", "where", "what"], rows[:FINDINGS]))
    return sections


def provenance(record: Mapping[str, Any]) -> list[Section]:
    """What made the numbers."""
    settings = yaml.safe_dump(record["config"], sort_keys=False)
    return [Code(settings, summary="The settings of this run", heading="Settings")]


def footer(record: Mapping[str, Any]) -> str:
    """Time and versions, in small print."""
    seconds = dict(record["seconds"])
    total = seconds.pop("total")
    stages = ", ".join(f"{stage} {value:.1f}" for stage, value in seconds.items())
    versions = ", ".join(f"{name} {version}" for name, version in record["versions"].items())
    return f"Found in {total:.0f} s ({stages}). {versions[:1].upper()}{versions[1:]}."
