"""What find_gap leaves in its folder: the report, gap.json and corrected.yaml."""

from __future__ import annotations

import contextlib
import dataclasses
import os
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from residual.gap import GapResult
from residual.logs import Finding
from simgap_files.atomic import atomic_write_text, flush_to_disk, write_sealed
from sims.loading import corrected_settings
from sims.model_files import relative
from studies.gap.forecasts import bars, curves, rollouts, set_aside, tiles, where
from studies.gap.lead import lead
from studies.gap.verdicts import apart, banners, blind, evidence
from studies.gap.words import found_once
from studies.reporting.sections import Code, Prose, Report, Section, Table
from studies.running.versions import versions

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
    settings = yaml.safe_dump(record["config"], sort_keys=False)
    sections: list[Section] = [
        *banners(result, record["config"].get("tolerance")),
        tiles(result),
        *rollouts(result, figures),
        bars(result, figures),
        *curves(result, figures),
        *set_aside(result),
        *where(result, figures),
        evidence(result),
        *apart(result),
        *blind(result),
        *quality(result, record),
        Code(settings, summary="The settings of this run", heading="Settings"),
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


def footer(record: Mapping[str, Any]) -> str:
    """Time and versions, in small print."""
    seconds = dict(record["seconds"])
    total = seconds.pop("total")
    stages = ", ".join(f"{stage} {value:.1f}" for stage, value in seconds.items())
    versions = ", ".join(f"{name} {version}" for name, version in record["versions"].items())
    return f"Found in {total:.0f} s ({stages}). {versions[:1].upper()}{versions[1:]}."


JSON, CORRECTED, REPORT = "gap.json", "corrected.yaml", "report.html"


def write_gap(
    result: GapResult,
    folder: str | Path,
    config: Mapping[str, Any],
    findings: Sequence[Finding] = (),
    seconds: float | None = None,
) -> None:
    """Write ``gap.json``, ``corrected.yaml``, ``report.html`` and ``figures/``: all or nothing.

    Args:
        result: What was found.
        folder: Made if missing; files of the same names are replaced, others stay.
        config: The settings as plain values; ``config["simulator"]`` holds ``class_path`` and
            ``init_args`` of the nominal simulator (``sims.loading.simulator_settings``),
            ``config["logs"]`` the names of the runs.
        findings: What the reader of the logs had to say.
        seconds: Wall time; by default the sum over the stages.

    Raises:
        OSError: The folder cannot be written.
    """
    record = gap_record(result, config, findings, seconds)
    with staged(Path(folder)) as stage:
        corrected = corrected_settings(
            config["simulator"], result.effects, record["hold"], result.substeps
        )
        about = "# The simulator with what find_gap added; loadable as --simulator corrected.yaml\n"
        text = yaml.safe_dump(relative(corrected, folder), sort_keys=False)
        atomic_write_text(stage / CORRECTED, about + text)
        for name, content in result.corrected.own_files().items():
            (stage / name).write_bytes(content)
        write_report(result, record, stage)
        write_sealed(stage / JSON, record)


def gap_record(
    result: GapResult,
    config: Mapping[str, Any],
    findings: Sequence[Finding] = (),
    seconds: float | None = None,
) -> dict[str, Any]:
    """What ``gap.json`` holds (docs/gap-json.md)."""
    total = sum(result.seconds.values()) if seconds is None else seconds
    return {
        "says": lead(result, config.get("tolerance")),
        "cut_off": list(result.cut_off),
        "conventions": dataclasses.asdict(result.conventions) if result.conventions else None,
        "unlike": [dataclasses.asdict(one) for one in result.unlike],
        "changing": dataclasses.asdict(result.changing) if result.changing else None,
        "periodic": dataclasses.asdict(result.periodic) if result.periodic else None,
        "lone": dataclasses.asdict(result.lone) if result.lone else None,
        "verdicts": [dataclasses.asdict(verdict) for verdict in result.verdicts],
        "gap": dataclasses.asdict(result.gap),
        "held_out": dataclasses.asdict(result.held_out) if result.held_out else None,
        "hold": {channel.name: channel.hold for channel in result.corrected.action_channels},
        "evidence": [dataclasses.asdict(rival) for rival in result.evidence],
        "noise": {
            name: {"value": sigma, "error": error} for name, (sigma, error) in result.noise.items()
        },
        "quality": [
            {"kind": one.kind, "where": one.where, "says": one.says}
            for one in (*findings, *result.quality)
        ],
        "seconds": {"total": total, **result.seconds},
        "versions": versions(),
        "config": config,
    }


@contextlib.contextmanager
def staged(folder: Path) -> Iterator[Path]:
    """A temporary folder beside ``folder``; its files move there when the block ends well."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(
        f"-{folder.name}", ".partial-", folder.parent, ignore_cleanup_errors=True
    ) as made:
        stage = Path(made)
        yield stage
        for source in sorted(path for path in stage.rglob("*") if path.is_file()):
            target = folder / source.relative_to(stage)
            target.parent.mkdir(parents=True, exist_ok=True)
            flush_to_disk(source)
            os.replace(source, target)
