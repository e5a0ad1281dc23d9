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
continues where it stopped when the same command is given again. A system of your own:
python -m studies.learn --help.
"""

from __future__ import annotations

import dataclasses

from policy.config import DDPGConfig
from sims.system import System
from studies.learning.command import command
from studies.learning.study import Study, Trial
from studies.running.ending import run_as_imported
from studies.systems.pendulum import pendulum


@dataclasses.dataclass(frozen=True)
class PendulumTrial(Trial):
    """One trial: everything that its result depends on.

    Args:
        inertia_follows_mass: Let the true pendulum's inertia grow with its mass; the authors'
            code, and the default here, keeps it.
    """

    # The paper's.
    ddpg: DDPGConfig = dataclasses.field(default_factory=lambda: DDPGConfig(saturation_penalty=0.0))
    inertia_follows_mass: bool = False


def system_of(trial: PendulumTrial) -> System:
    """The system of a trial."""
    return pendulum(trial.inertia_follows_mass)


STUDY = Study("pendulum_gap", __doc__, PendulumTrial, system_of)
main = command(STUDY)


if __name__ == "__main__":
    run_as_imported("studies.pendulum_gap")
