"""The folder of a run: nothing of another one stays in it, and no other system's is overwritten."""

from __future__ import annotations

from collections.abc import Container, Mapping
from pathlib import Path
from typing import Any

from simgap_files.atomic import read_sealed
from studies.running.trials import PLAN, RESULTS


def refuse_other_run(folder: Path, study: str, config: Mapping[str, Any], grid: bool) -> None:
    """Refuse a folder with the results of another study, of another system, or of a grid beside a
    single trial.

    Args:
        folder: There already or not.
        study: Name of the study.
        config: Plain settings, with the system if the study has several.
        grid: Whether many trials are to go there.

    Raises:
        ValueError: The message says whose results are there.
    """
    remedy = "give another --output, or remove that folder"
    plan, single = _read(folder / PLAN), _read(folder / RESULTS)
    if plan:
        if not grid:
            raise ValueError(f"--output {folder} holds the trials of a grid: {remedy}")
        if plan.get("study") != study:
            raise ValueError(f"--output {folder} holds trials of {plan.get('study')}: {remedy}")
    elif "policies" in single:
        if grid:
            raise ValueError(f"--output {folder} holds the results of a single trial: {remedy}")
        own = [single.get("study"), single.get("config", {}).get("system")]
        if own != [study, config.get("system")]:
            raise ValueError(f"--output {folder} holds the results of {own[1] or own[0]}: {remedy}")


def keep_only(folder: Path, names: Container[str]) -> None:
    """Remove the files of a folder whose names, without their ends, are none of these."""
    for path in folder.glob("*"):
        if path.is_file() and path.stem not in names:
            path.unlink(missing_ok=True)


def _read(path: Path) -> dict[str, Any]:
    """What a file of results holds; nothing if it is not there or damaged."""
    try:
        return read_sealed(path)
    except (OSError, ValueError):
        return {}
