"""What every study of learning across the gap shares: its command line, one trial, and a grid.

A study file says what is its own: the settings of a trial, the systems and the task, and how
its results are reported (``studies/pendulum_gap.py``). Everything else is here.
"""

from __future__ import annotations

import copy
import dataclasses
import functools
import importlib.util
import json
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import threadpoolctl
import torch
import yaml
from jsonargparse.typing import NonNegativeFloat, PositiveInt
from sklearn.base import BaseEstimator

from policy.config import DDPGConfig
from residual import DropoutNet
from studies.learning.earlier import ReplayRule
from studies.learning.loop import Budget, learn_by_difference
from studies.learning.problem import Problem
from studies.learning.stages import Stages
from studies.running.command import HelpFormatter, Parser, class_label, expand_grid, fail, versions
from studies.running.curves import Curves
from studies.running.files import (
    atomic_write_json,
    atomic_write_text,
    copy_file,
    read_json,
    remove_partial_files,
)
from studies.running.progress import Bars, Progress, Several
from studies.running.trials import Execution, Failures, read_trials, run_trials, trial_folder
from studies.running.workers import Backend, WorkersError

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
        caution: Reward lost per step, on the corrected simulator, for each multiple of the
            difference model's typical standard deviation; 0 learns as in the paper.
        replay: What a training after an update learns from beside its own transitions: "first",
            as in the paper, from the second update on those of the first; "all", those of all
            trainings on the simulator so far, relabelled with the newest difference model.
    """

    estimator: BaseEstimator = dataclasses.field(default_factory=DropoutNet)
    seed: int = 0
    budget: Budget = dataclasses.field(default_factory=Budget)
    ddpg: DDPGConfig = dataclasses.field(default_factory=DDPGConfig)
    caution: NonNegativeFloat = 0.0
    replay: ReplayRule = "first"


@dataclasses.dataclass(frozen=True)
class GapStudy:
    """What sets one study apart from another.

    Its functions must be importable by name, since worker processes run them.

    Attributes:
        system: Its name in ``results.json`` and in the hashes of stages; the study's file is
            ``studies/<system>_gap.py``.
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

    system: str
    description: str | None
    trial: type[GapTrial]
    problem: Callable[[Any, Mapping[str, Any]], Problem]
    table: Callable[[Results], str]
    report: Callable[[Results, Path], object]
    grid_report: Callable[[Sequence[Results], Mapping[Path, str], Path], str]
    estimator: str = "residual.DropoutNet"

    @property
    def name(self) -> str:
        """Of the study's file and of its folder of results."""
        return f"{self.system}_gap"

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
        "--backend",
        type=Backend,
        default="local",
        help="Where many trials run: in local processes or on a cluster (docs/scaling.md).",
    )
    parser.add_argument(
        "--scheduler",
        type=str | None,
        default=None,
        help="Address of the cluster's scheduler, such as tcp://host:8786.",
    )
    parser.add_argument(
        "--tensorboard",
        type=Path | None,
        default=None,
        help="Folder for training curves; tensorboard --logdir shows them.",
    )
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
        trial.caution,
        trial.replay,
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


def grid_trial(
    study: GapStudy, stages: Path, config: Config, folder: Path, progress: Progress
) -> dict[str, Any]:
    """``run_trial`` as one of many."""
    return run_trial(study, config, folder, Stages(stages), progress)


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
