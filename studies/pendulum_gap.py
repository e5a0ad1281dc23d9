"""Learn to control the true pendulum from very few true samples, with a difference model.

An idealised policy fails on the true pendulum (64 % more mass). The study collects true
samples with it, learns the difference between simulator and pendulum, trains the policy on
simulator + difference, and shows what that brings: a table here, and a report, figures,
policies and models in the output folder.

  python -m studies.pendulum_gap
  python -m studies.pendulum_gap --estimator residual.GaussianProcess --budget.true_samples 400
  python -m studies.pendulum_gap --estimator sklearn.ensemble.ExtraTreesRegressor
  python -m studies.pendulum_gap --estimator my_file.MyRegressor --estimator.depth 3
  python -m studies.pendulum_gap --config studies/configs/budgets.yaml --jobs 2

Any scikit-learn regressor can be named by its import path, your own included. A killed run
continues where it stopped when the same command is given again.
"""

from __future__ import annotations

import copy
import dataclasses
import functools
import json
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import threadpoolctl
import torch
import yaml
from jsonargparse.typing import PositiveInt
from sklearn.base import BaseEstimator

from policy.ddpg import DDPGConfig
from residual import DropoutNet
from sims.pendulum import Pendulum
from sims.simulator import Simulator
from sims.tasks import SwingUp
from studies.command import HelpFormatter, Parser, class_label, expand_grid, fail, versions
from studies.difference_learning import Budget, learn_by_difference
from studies.files import atomic_write_json, atomic_write_text, copy_file
from studies.learning_steps import Problem
from studies.pendulum_report import policy_table, write_report
from studies.pendulum_tables import write_grid_report
from studies.progress import Bars, Progress, Silent
from studies.stages import Stages
from studies.trials import run_trials, trial_folder

RESULTS = Path("results/pendulum_gap")


@dataclasses.dataclass(frozen=True)
class PendulumTrial:
    """One trial: everything that its result depends on.

    Args:
        estimator: Learns the difference; any scikit-learn regressor by import path.
        seed: Everything random follows from it.
        budget: Samples and training steps.
        ddpg: Settings of DDPG, the same for every policy.
        inertia_follows_mass: Let the true pendulum's inertia grow with its mass; the authors'
            code, and the default here, keeps it.
        simulator: The simulator at hand instead of the idealised pendulum: a class path, or a
            YAML file such as the corrected.yaml of find_gap.
    """

    estimator: BaseEstimator = dataclasses.field(default_factory=DropoutNet)
    seed: int = 0
    budget: Budget = dataclasses.field(default_factory=Budget)
    ddpg: DDPGConfig = dataclasses.field(default_factory=DDPGConfig)
    inertia_follows_mass: bool = False
    simulator: Simulator | None = None


def build_parser() -> Parser:
    """The command line of this study."""
    parser = Parser(
        prog="python -m studies.pendulum_gap",
        description=__doc__,
        formatter_class=HelpFormatter,
    )
    parser.add_argument("--config", action="config", help="YAML file with any of the settings.")
    parser.add_argument(
        "--output",
        type=Path | None,
        default=None,
        help="Folder for the results; default: results/pendulum_gap/ and a name.",
    )
    parser.add_argument("--jobs", type=PositiveInt, default=1, help="Processes for many trials.")
    parser.add_argument(
        "--grid",
        type=list[dict[str, list[Any]]] | None,
        default=None,
        help="For config files: blocks of settings and the values they take; one trial for each "
        "combination within a block.",
    )
    parser.add_class_arguments(PendulumTrial, sub_configs=True)
    parser.set_defaults(estimator={"class_path": "residual.DropoutNet"})
    return parser


def run_trial(
    config: Mapping[str, Any], folder: Path, stages: Stages, progress: Progress
) -> dict[str, Any]:
    """One trial: ``config`` holds the settings of ``PendulumTrial`` as plain values.

    Args:
        config: As the parser dumps it.
        folder: For policies, models and rollouts.
        stages: Where finished steps are kept and found again.
        progress: Told of every step.

    Returns:
        What ``results.json`` holds (docs/results.md).
    """
    # One thread is fastest at these sizes and leaves the other cores to other trials.
    torch.set_num_threads(1)
    threadpoolctl.threadpool_limits(1)
    trial = instantiate(config)
    true = Pendulum.true(inertia_follows_mass=trial.inertia_follows_mass)
    problem = Problem(
        description={
            "system": "pendulum",
            "inertia_follows_mass": trial.inertia_follows_mass,
            "simulator": config["simulator"],
        },
        idealised=trial.simulator or Pendulum(),
        true=true,
        task=SwingUp(),
    )
    outcome = learn_by_difference(
        problem,
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
        "system": "pendulum",
        "estimator": config["estimator"]["class_path"],
        "label": class_label(config["estimator"]),
        "seed": trial.seed,
        "policies": outcome.policies,
        "accuracy": outcome.accuracy,
        "config": config,
        "versions": versions(),
    }


def instantiate(config: Mapping[str, Any]) -> PendulumTrial:
    """The trial that plain settings describe; exits with one line if they are wrong."""
    parser = build_parser()
    # The parser changes nested lists of what it is given.
    chosen = parser.instantiate(parser.parse_object(copy.deepcopy(dict(config))))
    names = [field.name for field in dataclasses.fields(PendulumTrial)]
    return PendulumTrial(**{name: chosen[name] for name in names})


def quiet_trial(stages: Path, config: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """``run_trial`` without progress, for worker processes."""
    return run_trial(config, folder, Stages(stages), Silent())


def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    parser = build_parser()
    given = parser.parse_args(arguments)
    settings = json.loads(parser.dump(given, format="json", skip_unset=False))
    output, jobs, grid = (settings.pop(name) for name in ("output", "jobs", "grid"))
    settings.pop("config", None)
    # Runs in the default place share their finished steps; a folder given holds all of its own.
    stages = (Path(output) if output else RESULTS) / "stages"
    # A wrong value is reported before anything is written.
    try:
        instantiate(settings)
    except ValueError as error:
        fail(str(error))
    if grid:
        name = Path(str(given.config[0])).stem if given.config else "grid"
        target = Path(output) if output else RESULTS / name
        run_grid(settings, grid, target, stages, jobs)
    else:
        label = trial_label(settings)
        target = Path(output) if output else trial_folder(RESULTS, label, settings)
        run_single(settings, target, stages)


def run_single(settings: dict[str, Any], output: Path, stages: Path) -> None:
    """One trial with progress bars, a table on the terminal and a report."""
    begin = time.perf_counter()
    results = run_trial(settings, output, Stages(stages), Bars())
    results["seconds"] = time.perf_counter() - begin
    atomic_write_text(output / "config.yaml", yaml.safe_dump(settings, sort_keys=False))
    write_report(results, output)
    atomic_write_json(output / "results.json", results)
    print(f"\n{policy_table(results)}\n\nreport: {output / 'report.html'}")


def run_grid(
    settings: dict[str, Any],
    grid: list[dict[str, list[Any]]],
    output: Path,
    stages: Path,
    jobs: int,
) -> None:
    """Many trials, a table over all of them and a report."""
    try:
        configs = [resolve(config) for config in expand_grid(settings, grid)]
        for config in configs:
            instantiate(config)
    except ValueError as error:
        fail(str(error))
    trials = {trial_folder(output, trial_label(config), config): config for config in configs}
    results, failures = run_trials(trials, functools.partial(quiet_trial, stages), jobs, Bars())
    if results:
        print(f"\n{write_grid_report(results, failures, output)}")
        print(f"\nreport: {output / 'report.html'}")
    for folder, failure in failures.items():
        reason = failure.strip().splitlines()[-1]
        print(f"failed: {folder}: {reason} (see error.txt there)", file=sys.stderr)
    if failures:
        raise SystemExit(1)


def resolve(config: Mapping[str, Any]) -> dict[str, Any]:
    """``config`` with every default filled in, checked by the parser."""
    parser = build_parser()
    chosen = parser.parse_object(copy.deepcopy(dict(config)))
    settings = json.loads(parser.dump(chosen, format="json", skip_unset=False))
    return {field.name: settings[field.name] for field in dataclasses.fields(PendulumTrial)}


def trial_label(config: Mapping[str, Any]) -> str:
    """A readable name for a trial's folder."""
    estimator = config["estimator"]["class_path"].rsplit(".", 1)[-1]
    return f"{estimator}-{config['budget']['true_samples']}-seed{config['seed']}"


if __name__ == "__main__":
    # By its importable name, which worker processes need to find the same classes.
    from studies import pendulum_gap

    pendulum_gap.main()
