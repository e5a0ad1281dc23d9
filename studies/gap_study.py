"""What every study of learning across the gap shares: its command line, one trial, and a grid.

A study file says what is its own: the settings of a trial, the systems and the task, and how
its results are reported (``studies/pendulum_gap.py``). Everything else is here.
"""

from __future__ import annotations

import copy
import dataclasses
import functools
import json
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import threadpoolctl
import torch
import yaml
from jsonargparse.typing import PositiveInt
from sklearn.base import BaseEstimator

from policy.ddpg import DDPGConfig
from residual import DropoutNet
from studies.command import HelpFormatter, Parser, class_label, expand_grid, fail, versions
from studies.difference_learning import Budget, learn_by_difference
from studies.files import atomic_write_json, atomic_write_text, copy_file
from studies.learning_steps import Problem
from studies.progress import Bars, Progress, Silent
from studies.stages import Stages
from studies.trials import run_trials, trial_folder

Config = Mapping[str, Any]
Results = Mapping[str, Any]


@dataclasses.dataclass(frozen=True)
class GapTrial:
    """One trial: everything that its result depends on. A study adds its own settings.

    Args:
        estimator: Learns the difference; any scikit-learn regressor by import path.
        seed: Everything random follows from it.
        budget: Samples and training steps.
        ddpg: Settings of DDPG, the same for every policy.
    """

    estimator: BaseEstimator = dataclasses.field(default_factory=DropoutNet)
    seed: int = 0
    budget: Budget = dataclasses.field(default_factory=Budget)
    ddpg: DDPGConfig = dataclasses.field(default_factory=DDPGConfig)


@dataclasses.dataclass(frozen=True)
class GapStudy:
    """What sets one study apart from another.

    Its functions must be importable by name, since worker processes run them.

    Attributes:
        name: Of the study's file, such as ``"pendulum_gap"``.
        system: Of the system, in ``results.json`` and in what names a stage.
        description: Help text of the command.
        trial: Settings of one trial, a dataclass that extends ``GapTrial``.
        problem: The systems and the task of a trial; its second argument is the description to
            give the problem: the system's name and the settings that are the study's own.
        table: The results of one trial as text.
        report: Writes the report of one trial into its folder.
        grid_report: Writes the report of all finished trials, given the tracebacks of those
            that failed by folder; returns the main table as text.
        estimator: Class path of the default estimator.
    """

    name: str
    system: str
    description: str | None
    trial: type[GapTrial]
    problem: Callable[[Any, Mapping[str, Any]], Problem]
    table: Callable[[Results], str]
    report: Callable[[Results, Path], object]
    grid_report: Callable[[Sequence[Results], Mapping[Path, str], Path], str]
    estimator: str = "residual.DropoutNet"

    @property
    def settings(self) -> list[str]:
        """Names of a trial's settings."""
        return [field.name for field in dataclasses.fields(self.trial)]

    def describe(self, config: Config) -> dict[str, Any]:
        """What identifies the problem of a trial, in plain values."""
        shared = {field.name for field in dataclasses.fields(GapTrial)}
        own = {name: config[name] for name in self.settings if name not in shared}
        return {"system": self.system, **own}


def build_parser(study: GapStudy) -> Parser:
    """The command line of a study."""
    parser = Parser(
        prog=f"python -m studies.{study.name}",
        description=study.description,
        formatter_class=HelpFormatter,
    )
    parser.add_argument("--config", action="config", help="YAML file with any of the settings.")
    parser.add_argument(
        "--output",
        type=Path | None,
        default=None,
        help=f"Folder for the results; default: results/{study.name}/ and a name.",
    )
    parser.add_argument("--jobs", type=PositiveInt, default=1, help="Processes for many trials.")
    parser.add_argument(
        "--grid",
        type=list[dict[str, list[Any]]] | None,
        default=None,
        help="For config files: blocks of settings and the values they take; one trial for each "
        "combination within a block.",
    )
    parser.add_class_arguments(study.trial, sub_configs=True)
    parser.set_defaults(estimator={"class_path": study.estimator})
    return parser


def run_command(study: GapStudy, arguments: Sequence[str] | None = None) -> None:
    """The command of a study: one trial, or the grid of a config file."""
    parser = build_parser(study)
    given = parser.parse_args(arguments)
    settings = json.loads(parser.dump(given, format="json", skip_unset=False))
    output, jobs, grid = (settings.pop(name) for name in ("output", "jobs", "grid"))
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
        run_grid(study, settings, grid, Path(output) if output else home / name, stages, jobs)
    else:
        folder = trial_folder(home, trial_label(settings), settings)
        run_single(study, settings, Path(output) if output else folder, stages)


def run_single(study: GapStudy, settings: dict[str, Any], output: Path, stages: Path) -> None:
    """One trial with progress bars, a table on the terminal and a report."""
    begin = time.perf_counter()
    results = run_trial(study, settings, output, Stages(stages), Bars())
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
    jobs: int,
) -> None:
    """Many trials, a table over all of them and a report."""
    try:
        configs = [resolve(study, config) for config in expand_grid(settings, grid)]
        for config in configs:
            instantiate(study, config)
    except ValueError as error:
        fail(str(error))
    trials = {trial_folder(output, trial_label(config), config): config for config in configs}
    work = functools.partial(quiet_trial, study, stages)
    results, failures = run_trials(trials, work, jobs, Bars())
    if results:
        print(f"\n{study.grid_report(results, failures, output)}")
        print(f"\nreport: {output / 'report.html'}")
    for folder, failure in failures.items():
        reason = failure.strip().splitlines()[-1]
        print(f"failed: {folder}: {reason} (see error.txt there)", file=sys.stderr)
    if failures:
        raise SystemExit(1)


def run_trial(
    study: GapStudy, config: Config, folder: Path, stages: Stages, progress: Progress
) -> dict[str, Any]:
    """One trial of a study.

    Args:
        study: Which one.
        config: The settings of the study's trial as plain values, as the parser dumps them.
        folder: For policies, models and rollouts.
        stages: Where finished steps are kept and found again.
        progress: Told of every step.

    Returns:
        What ``results.json`` holds (docs/results.md).
    """
    # One thread is fastest at these sizes and leaves the other cores to other trials.
    torch.set_num_threads(1)
    threadpoolctl.threadpool_limits(1)
    trial = instantiate(study, config)
    outcome = learn_by_difference(
        study.problem(trial, study.describe(config)),
        trial.estimator,
        trial.budget,
        trial.ddpg,
        trial.seed,
        stages,
        progress,
    )
    for name, source in outcome.folders.items():
        copy_file(source / "agent.safetensors", folder / "policies" / f"{name}.safetensors")
        copy_file(source / "rollout.npz", folder / "rollouts" / f"{name}.npz")
    for number, source in enumerate(outcome.models, start=1):
        if (saved := source / "difference.safetensors").exists():
            copy_file(saved, folder / "models" / f"difference-{number}.safetensors")
    return {
        "system": study.system,
        "estimator": config["estimator"]["class_path"],
        "label": class_label(config["estimator"]),
        "seed": trial.seed,
        "policies": outcome.policies,
        "accuracy": outcome.accuracy,
        "config": config,
        "versions": versions(),
    }


def quiet_trial(study: GapStudy, stages: Path, config: Config, folder: Path) -> dict[str, Any]:
    """``run_trial`` without progress, for worker processes."""
    return run_trial(study, config, folder, Stages(stages), Silent())


def instantiate(study: GapStudy, config: Config) -> GapTrial:
    """The trial that plain settings describe; exits with one line if they are wrong."""
    parser = build_parser(study)
    # The parser changes nested lists of what it is given.
    chosen = parser.instantiate(parser.parse_object(copy.deepcopy(dict(config))))
    return study.trial(**{name: chosen[name] for name in study.settings})


def resolve(study: GapStudy, config: Config) -> dict[str, Any]:
    """``config`` with every default filled in, checked by the parser."""
    parser = build_parser(study)
    chosen = parser.parse_object(copy.deepcopy(dict(config)))
    settings = json.loads(parser.dump(chosen, format="json", skip_unset=False))
    return {name: settings[name] for name in study.settings}


def trial_label(config: Config) -> str:
    """A readable name for a trial's folder."""
    estimator = config["estimator"]["class_path"].rsplit(".", 1)[-1]
    return f"{estimator}-{config['budget']['true_samples']}-seed{config['seed']}"
