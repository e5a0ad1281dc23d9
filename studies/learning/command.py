"""The command of a study: one trial, or the grid of a config file."""

from __future__ import annotations

import dataclasses
import functools
import importlib.util
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import yaml

from simgap_files.atomic import atomic_write_text, remove_partial_files, write_sealed
from studies.learning.output import keep_only, refuse_other_run
from studies.learning.study import Study
from studies.learning.trial import (
    ALIASES,
    build_parser,
    code_of_trial,
    instantiate,
    resolve,
    run_trial,
    trial_label,
)
from studies.running.ending import check_output, fail, guarded
from studies.running.grids import expand_grid
from studies.running.progress import Bars, Curves, Several
from studies.running.trials import (
    Execution,
    run_trials,
    trial_folder,
)


def command(study: Study) -> Callable[..., None]:
    """The function ``main(arguments=None)`` of a study's file."""

    @guarded()
    def main(arguments: Sequence[str] | None) -> None:
        run_command(study, arguments)

    return main


def run_command(study: Study, arguments: Sequence[str] | None = None) -> None:
    """The command of a study: one trial, or the grid of a config file."""
    parser = build_parser(study)
    given = parser.parse_args(arguments)
    settings = parser.plain(given)
    output, grid = settings.pop("output"), settings.pop("grid")
    settings["tensorboard"] = _curves_folder(settings["tensorboard"])
    execution = Execution(**{f.name: settings.pop(f.name) for f in dataclasses.fields(Execution)})
    settings.pop("config", None)
    home = Path("results", study.name)
    # Runs in the default place share their finished steps; a folder given holds all of its own.
    kept = (Path(output) if output else home) / "stages"
    # A wrong value is reported before anything is written.
    study.system_of(instantiate(study, settings)).check()
    check_output(output or home)
    if execution.backend != "local" and not grid:
        fail(
            f"--backend {execution.backend} runs the trials of a grid, expected a config with grid:"
        )
    if grid:
        name = Path(str(given.config[0])).stem if given.config else "grid"
        target = Path(output) if output else home / name
        refuse_other_run(target, study.name, settings, grid=True)
        run_grid(study, settings, grid, target, kept, execution)
    else:
        folder = trial_folder(home, trial_label(settings), settings)
        target = Path(output) if output else folder
        refuse_other_run(target, study.name, settings, grid=False)
        run_single(study, settings, target, kept, execution)


def _curves_folder(folder: str | None) -> Path | None:
    if folder and importlib.util.find_spec("tensorboard") is None:
        fail(
            "--tensorboard needs the package tensorboard: "
            "`pip install tensorboard` (extra `tensorboard`)"
        )
    return Path(folder).resolve() if folder else None


def run_single(
    study: Study, settings: dict[str, Any], output: Path, kept: Path, execution: Execution
) -> None:
    """One trial in this process with progress bars, a table on the terminal and a report."""
    # Pictures take a second to load, for which no wrong word waits.
    from studies.learnt.films import write_films
    from studies.learnt.run_report import report_single

    begin = time.perf_counter()
    remove_partial_files(output)
    curves = [Curves(execution.tensorboard / output.name)] if execution.tensorboard else []
    results = run_trial(study, kept, settings, output, Several(Bars(), *curves))
    results["seconds"] = time.perf_counter() - begin
    atomic_write_text(output / "config.yaml", yaml.safe_dump(settings, sort_keys=False))
    for pictures in ("films", "figures"):
        keep_only(output / pictures, ())
    write_films(results, output, study.system_of(instantiate(study, settings)).nominal)
    write_sealed(output / "results.json", results)
    report_single(results, output)


def run_grid(
    study: Study,
    settings: dict[str, Any],
    grid: list[dict[str, list[Any]]],
    output: Path,
    kept: Path,
    execution: Execution,
) -> None:
    """Many trials, a table over all of them and a report."""
    from studies.learnt.run_report import report_grid

    blocks = [{ALIASES.get(name, name): block[name] for name in block} for block in grid]
    configs = [resolve(study, config) for config in expand_grid(settings, blocks)]
    trials = {trial_folder(output, trial_label(config), config): config for config in configs}
    made_by = {folder: code_of_trial(study, config) for folder, config in trials.items()}
    remove_partial_files(output)
    work = functools.partial(run_trial, study, kept.resolve())
    run_trials(study.name, trials, work, execution, made_by)
    failures = report_grid(output)
    if failures:
        raise SystemExit(1)
