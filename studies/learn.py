"""Learn to control a system of your own from few samples of it, with a difference model.

Bring a simulator, the real system (another simulator, or a Gymnasium environment) and a task, as
one object in a file of your own (docs/tutorial-learn.md):

  SYSTEM = sims.System("cart_pole", nominal=CartPole(), true=..., task=Balance())

  python -m studies.learn --system cart_pole.SYSTEM
  python -m studies.learn --system cart_pole.SYSTEM --estimator sklearn.ensemble.ExtraTreesRegressor
  python -m studies.learn --system cart_pole.SYSTEM --learner stable_baselines3.SAC
  python -m studies.learn --system cart_pole.SYSTEM --config grid.yaml --jobs 2

A policy learns on the simulator; then, again and again, the last policy collects true samples, the
difference between simulator and system is learnt, and the policy trains on simulator + difference.
What that brings is a table here, and a report, figures, policies and models in the output folder.
A killed run continues where it stopped when the same command is given again.
"""

from __future__ import annotations

import dataclasses
import inspect

from policy.learner import imported
from sims.system import System
from studies.learning.budget import Budget
from studies.learning.command import command
from studies.learning.study import Study, Trial
from studies.running.ending import run_as_imported


@dataclasses.dataclass(frozen=True)
class LearnTrial(Trial):
    """One trial: everything that its result depends on.

    Args:
        system: What it is about: the import path of a sims.System, or of a function without
            arguments that makes one, such as cart_pole.SYSTEM.
    """

    system: str = ""
    budget: Budget = dataclasses.field(default_factory=lambda: Budget(true_samples=450))


def system_of(trial: LearnTrial) -> System:
    """The system that a trial names.

    Raises:
        ValueError: There is none.
    """
    if not trial.system:
        raise ValueError("which system? Give --system my_file.SYSTEM, a sims.System")
    found = imported(trial.system, "system")
    if not isinstance(found, System) and callable(found):
        try:
            inspect.signature(found).bind()
        except TypeError as error:
            raise ValueError(
                f"{trial.system} cannot be called without arguments: {error}"
            ) from None
        found = found()
    if not isinstance(found, System):
        raise ValueError(
            f"{trial.system} is a {type(found).__name__}, expected a sims.System, or a function "
            "that makes one"
        )
    return found


STUDY = Study("learn", __doc__, LearnTrial, system_of, "residual.GaussianProcess", scaled=True)
main = command(STUDY)


if __name__ == "__main__":
    run_as_imported("studies.learn")
