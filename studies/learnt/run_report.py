"""What a run of the loop ends with: tables and report, of one trial or of a grid."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from simgap_files.atomic import read_sealed
from studies.learnt.report import read_episodes, write_report
from studies.learnt.tables import write_tables
from studies.running.trials import Failures, read_trials, tell_failures


def report_single(results: dict[str, Any], folder: Path) -> None:
    """Table and report of one trial from what it left in its folder."""
    films = {path.stem: path for path in sorted((folder / "films").glob("*.gif"))}
    table = write_report([results], folder, read_episodes(results, folder), films)
    print(f"\n{table}\n\nreport: {folder / 'report.html'}")


def report_grid(folder: Path) -> Failures:
    """Tables and report of a grid from the trials in its folder; returns the failed ones."""
    results, failures = read_trials(folder)
    if results:
        write_tables(results, folder)
        table = write_report(results, folder, failures=failures)
        print(f"\n{table}\n\nreport: {folder / 'report.html'}")
    tell_failures(failures)
    return failures


def rebuild(folder: Path) -> None:
    """Tables, figures and report of a finished or unfinished run, without computing trials.

    Raises:
        FileNotFoundError: Nothing in the folder is finished.
        ValueError: An earlier version wrote it.
    """
    path = folder / "results.json"
    single = read_sealed(path) if path.exists() else {}
    found = [single] if "policies" in single else read_trials(folder)[0]
    if not found:
        raise FileNotFoundError(f"{folder}: no trial in it is finished")
    if "about" not in found[0]:
        raise ValueError(f"{folder} is of an earlier version: give its command again")
    if found[0] is single:
        report_single(single, folder)
    else:
        report_grid(folder)
