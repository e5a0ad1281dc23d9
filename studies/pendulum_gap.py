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

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

from sims.pendulum import Pendulum
from sims.simulator import Simulator
from sims.tasks import SwingUp
from studies.learning.command import run_command
from studies.learning.problem import Problem
from studies.learning.settings import build_parser as parser_of
from studies.learning.study import GapStudy, GapTrial
from studies.pendulum.report import policy_table, write_report
from studies.pendulum.tables import write_grid_report
from studies.running.command import Parser


@dataclasses.dataclass(frozen=True)
class PendulumTrial(GapTrial):
    """One trial: everything that its result depends on.

    Args:
        inertia_follows_mass: Let the true pendulum's inertia grow with its mass; the authors'
            code, and the default here, keeps it.
        simulator: The simulator at hand instead of the idealised pendulum: a class path, or a
            YAML file such as the corrected.yaml of find_gap.
    """

    inertia_follows_mass: bool = False
    simulator: Simulator | None = None


def problem(trial: PendulumTrial, description: Mapping[str, Any]) -> Problem:
    """Swing-up on a pendulum that is heavier than the idealised one."""
    return Problem(
        description=description,
        idealised=trial.simulator or Pendulum(),
        true=Pendulum.true(inertia_follows_mass=trial.inertia_follows_mass),
        task=SwingUp(),
    )


STUDY = GapStudy(
    system="pendulum",
    description=__doc__,
    trial=PendulumTrial,
    problem=problem,
    table=policy_table,
    report=write_report,
    grid_report=write_grid_report,
)


def build_parser() -> Parser:
    """The command line of this study."""
    return parser_of(STUDY)


def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    run_command(STUDY, arguments)


if __name__ == "__main__":
    # By its importable name, which worker processes need to find the same classes.
    from studies import pendulum_gap

    pendulum_gap.main()
