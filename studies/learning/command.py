"""The command of a study: one trial, or the grid of a config file."""

from __future__ import annotations

import functools
import importlib.util
import json
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml

from studies.learning.settings import build_parser, instantiate, resolve, trial_label
from studies.learning.stages import Stages
from studies.learning.study import Config, GapStudy
from studies.learning.trial import run_trial
from studies.running.command import expand_grid, fail
from studies.running.curves import Curves
from studies.running.files import (
    atomic_write_json,
    atomic_write_text,
    read_json,
    remove_partial_files,
)
from studies.running.progress import Bars, Progress, Several
from studies.running.trials import Execution, Failures, read_trials, run_trials, trial_folder
from studies.running.workers import WorkersError


def run_command(study: GapStudy, arguments: Sequence[str] | None = None) -> None:
    """The command of a study: one trial, or the grid of a config file."""
    parser = build_parser(study)
    given = parser.parse_args(arguments)
    settings = json.loads(parser.dump(given, format="json", skip_unset=False))
    output, grid = settings.pop("output"), settings.pop("grid")
    execution = Execution(
        **{name: settings.pop(name) for name in ("backend", "jobs", "scheduler")},
        tensorboard=_curves_folder(settings.pop("tensorboard")),
    )
    settings.pop("config", None)
    home = Path("results", study.name)
    # Runs in the default place share their finished steps; a folder given holds all of its own.
    stages = (Path(output) if output else home) / "stages"
    # A wrong value is reported before anything is written.
    try:
        instantiate(study, settings)
    except ValueError as error:
        fail(str(error))
    if grid:
        name = Path(str(given.config[0])).stem if given.config else "grid"
        target = Path(output) if output else home / name
        run_grid(study, settings, grid, target, stages, execution)
    else:
        folder = trial_folder(home, trial_label(settings), settings)
        target = Path(output) if output else folder
        run_single(study, settings, target, stages, execution)


def _curves_folder(folder: str | None) -> Path | None:
    if folder and importlib.util.find_spec("tensorboard") is None:
        fail("TensorBoard is not installed: pip install 'simgap[tensorboard]'")
    return Path(folder).resolve() if folder else None


def run_single(
    study: GapStudy, settings: dict[str, Any], output: Path, stages: Path, execution: Execution
) -> None:
    """One trial in this process with progress bars, a table on the terminal and a report."""
    begin = time.perf_counter()
    remove_partial_files(output)
    curves = [Curves(execution.tensorboard / output.name)] if execution.tensorboard else []
    results = run_trial(study, settings, output, Stages(stages), Several(Bars(), *curves))
    results["seconds"] = time.perf_counter() - begin
    atomic_write_text(output / "config.yaml", yaml.safe_dump(settings, sort_keys=False))
    study.report(results, output)
    atomic_write_json(output / "results.json", results)
    print(f"\n{study.table(results)}\n\nreport: {output / 'report.html'}")


def run_grid(
    study: GapStudy,
    settings: dict[str, Any],
    grid: list[dict[str, list[Any]]],
    output: Path,
    stages: Path,
    execution: Execution,
) -> None:
    """Many trials, a table over all of them and a report."""
    try:
        configs = [resolve(study, config) for config in expand_grid(settings, grid)]
        for config in configs:
            instantiate(study, config)
    except ValueError as error:
        fail(str(error))
    remove_partial_files(output)
    trials = {trial_folder(output, trial_label(config), config): config for config in configs}
    work = functools.partial(grid_trial, study, stages.resolve())
    try:
        run_trials(study.name, trials, work, execution)
    except WorkersError as error:
        fail(str(error))
    failures = report_grid(study, output)
    if failures:
        raise SystemExit(1)


def report_grid(study: GapStudy, folder: Path) -> Failures:
    """Tables and report of a grid from the trials in its folder; returns the failed ones."""
    results, failures = read_trials(folder)
    if results:
        print(f"\n{study.grid_report(results, failures, folder)}")
        print(f"\nreport: {folder / 'report.html'}")
    for path, failure in failures.items():
        reason = failure.strip().splitlines()[-1]
        print(f"failed: {path}: {reason} (see error.txt there)", file=sys.stderr)
    return failures


def rebuild(study: GapStudy, folder: Path) -> None:
    """Tables, figures and report of a finished or unfinished run, without computing trials.

    Raises:
        FileNotFoundError: Nothing in the folder is finished.
    """
    path = folder / "results.json"
    results = read_json(path) if path.exists() else {}
    if "policies" in results:
        study.report(results, folder)
        print(f"\n{study.table(results)}\n\nreport: {folder / 'report.html'}")
    elif not read_trials(folder)[0]:
        raise FileNotFoundError(f"{folder}: no trial in it is finished")
    else:
        report_grid(study, folder)


def grid_trial(
    study: GapStudy, stages: Path, config: Config, folder: Path, progress: Progress
) -> dict[str, Any]:
    """``run_trial`` as one of many."""
    return run_trial(study, config, folder, Stages(stages), progress)
