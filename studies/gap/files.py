"""What find_gap leaves in its folder: gap.json, corrected.yaml, and the report beside them."""

from __future__ import annotations

import contextlib
import dataclasses
import os
import secrets
import shutil
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from residual.gap import GapResult
from residual.logs import Finding
from simgap_files import atomic_write_text, flush_to_disk, write_sealed
from sims.loading import corrected_settings
from sims.model_files import relative
from studies.gap.lead import lead
from studies.gap.report import write_report
from studies.running.versions import versions

JSON, CORRECTED, REPORT = "gap.json", "corrected.yaml", "report.html"


def write_gap(
    result: GapResult,
    folder: str | Path,
    config: Mapping[str, Any],
    findings: Sequence[Finding] = (),
    seconds: float | None = None,
) -> Path:
    """Write ``gap.json``, ``corrected.yaml``, ``report.html`` and ``figures/``: all or nothing.

    Args:
        result: What was found.
        folder: Made if missing; files of the same names are replaced, others stay.
        config: The settings as plain values; ``config["simulator"]`` holds ``class_path`` and
            ``init_args`` of the nominal simulator (``sims.loading.simulator_settings``).
        findings: What the reader of the logs had to say.
        seconds: Wall time; by default the sum over the stages.

    Returns:
        The folder.

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
    return Path(folder)


def gap_record(
    result: GapResult,
    config: Mapping[str, Any],
    findings: Sequence[Finding] = (),
    seconds: float | None = None,
) -> dict[str, Any]:
    """What ``gap.json`` holds (docs/find-gap.md)."""
    total = sum(result.seconds.values()) if seconds is None else seconds
    return {
        "says": lead(result, config.get("tolerance")),
        "conventions": dataclasses.asdict(result.conventions) if result.conventions else None,
        "verdicts": [dataclasses.asdict(verdict) for verdict in result.verdicts],
        "gap": dataclasses.asdict(result.gap),
        "held_out": dataclasses.asdict(result.held_out) if result.held_out else None,
        "hold": {channel.name: channel.hold for channel in result.corrected.action_channels},
        "evidence": [dataclasses.asdict(rival) for rival in result.evidence],
        "noise": {
            name: {"value": sigma, "error": error} for name, (sigma, error) in result.noise.items()
        },
        "quality": [
            *({"kind": f.kind, "where": f.where, "says": f.says} for f in findings),
            *({"kind": "engine", "where": "", "says": says} for says in result.quality),
        ],
        "seconds": {"total": total, **result.seconds},
        "versions": versions(),
        "config": config,
    }


@contextlib.contextmanager
def staged(folder: Path) -> Iterator[Path]:
    """A temporary folder beside ``folder``; its files move there when the block ends well."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    stage = folder.parent / f".partial-{secrets.token_hex(4)}-{folder.name}"
    stage.mkdir()
    try:
        yield stage
        for source in sorted(path for path in stage.rglob("*") if path.is_file()):
            target = folder / source.relative_to(stage)
            target.parent.mkdir(parents=True, exist_ok=True)
            flush_to_disk(source)
            os.replace(source, target)
    finally:
        shutil.rmtree(stage, ignore_errors=True)
