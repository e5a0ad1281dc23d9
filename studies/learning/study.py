"""A command of the loop: the settings of a trial, and the system that they mean.

``studies/learn.py`` is the command for any system; ``pendulum_gap.py`` and ``leo_gap.py`` are the
same with a system of their own.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

from sklearn.base import BaseEstimator

from policy.config import DDPGConfig
from policy.learner import OURS, Algorithm
from residual import DropoutNet
from residual.estimator import check_regressor
from sims.measured import Measurement
from sims.same_channels import check_same_channels
from sims.simulator import Simulator
from sims.system import System
from studies.learning.budget import Budget
from studies.learning.warm_start import ReplayRule

Config = Mapping[str, Any]


@dataclasses.dataclass(frozen=True)
class Trial:
    """One trial: everything that its result depends on. A command adds its own settings.

    Args:
        estimator: Learns the difference: residual.GaussianProcess, DropoutNet, Linear, Ensemble
            or NamedEffects, or any scikit-learn regressor by import path.
        seed: Everything random follows from it.
        budget: Samples and training steps.
        learner: What learns the policies: policy.DDPG, or an off-policy algorithm of
            Stable-Baselines3 such as stable_baselines3.SAC.
        learner_options: Settings of an algorithm other than policy.DDPG.
        ddpg: Settings of policy.DDPG, the same for every policy; its exploration noise is also
            that of collecting.
        uncertainty_penalty: Reward lost per step, on the corrected simulator, for each multiple
            of the difference model's typical standard deviation; 0 learns as in the paper.
        replay: What a training after an update learns from beside its own transitions: "first",
            as in the paper, from the second update on those of the first; "all", those of all
            trainings on the simulator so far, relabelled with the newest difference model.
        simulator: The simulator at hand instead of the system's: a class path, or a YAML file
            such as the corrected.yaml of find_gap.
        corrected: A simulator with what it lacked, such as the corrected.yaml of find_gap: a
            policy is trained on it too, from the idealised one, without a true sample.
        measure: What sensors show of the true system, to the policy and to the difference model;
            by default all of the state, without error.
        smoothing: Learn the difference from smoothed paths where states are measured; false takes
            one measured state from the next.
    """

    estimator: BaseEstimator = dataclasses.field(default_factory=DropoutNet)
    seed: int = 0
    budget: Budget = dataclasses.field(default_factory=Budget)
    learner: str = OURS
    learner_options: dict[str, Any] = dataclasses.field(default_factory=dict)
    ddpg: DDPGConfig = dataclasses.field(default_factory=DDPGConfig)
    uncertainty_penalty: float = 0.0
    replay: ReplayRule = "first"
    simulator: Simulator | None = None
    corrected: Simulator | None = None
    measure: Measurement = dataclasses.field(default_factory=Measurement)
    smoothing: bool = True

    @property
    def algorithm(self) -> Algorithm:
        """What learns the policies."""
        return Algorithm(self.learner, self.ddpg, self.learner_options)


@dataclasses.dataclass(frozen=True)
class Study:
    """A command of the loop.

    Its function must be importable by name, since worker processes run it.

    Attributes:
        name: Of its file in ``studies/`` and of its folder of results.
        description: Help text.
        trial: Settings of one trial, a dataclass that extends ``Trial``.
        system: The system of a trial.
        estimator: Class path of the default estimator.
        scaled: Whether policies see observations and rewards scaled, see ``Steps``.
    """

    name: str
    description: str | None
    trial: type[Trial]
    system: Callable[[Any], System]
    estimator: str = "residual.DropoutNet"
    scaled: bool = False

    @property
    def settings(self) -> list[str]:
        """Names of a trial's settings."""
        return [field.name for field in dataclasses.fields(self.trial)]

    def system_of(self, trial: Trial) -> System:
        """The system of a trial, checked against its other settings.

        Raises:
            ValueError: They do not fit together, or a budget is too small to learn anything.
        """
        system = self.system(trial)
        if trial.simulator is not None:
            system = system.with_nominal(trial.simulator)
        trial.measure.check(system.nominal)
        if trial.measure.unmeasured and not trial.smoothing:
            raise ValueError(
                "smoothing is false, but measure.unmeasured leaves no state to take differences of"
            )
        system = dataclasses.replace(system, measurement=trial.measure)
        usual = self.trial()
        if trial.learner != OURS and trial.ddpg != usual.ddpg:
            raise ValueError(
                f"ddpg has settings of {OURS}, but {trial.learner} learns: give its own as "
                "learner_options"
            )
        check_regressor(trial.estimator, system.nominal)
        if trial.seed < 0:
            raise ValueError(f"seed is {trial.seed}, expected a whole number from 0")
        trial.budget.check(trial.algorithm, trial.replay == "all", trial.corrected is not None)
        if trial.corrected is not None:
            # Delay, lag and play have a memory, which is more state than the nominal one has.
            named = f"corrected: {trial.corrected.name} (--simulator takes any)"
            check_same_channels(system.nominal, trial.corrected, named, memory=True)
        memory = [c.name for c in system.nominal.state_channels if c.kind == "memory"]
        if memory and trial.budget.iterations:
            raise ValueError(
                f"{system.nominal.name} has hidden memory ({', '.join(memory)}), which no true "
                "sample tells a difference model: give --budget.iterations 0"
            )
        on_truth = trial.budget.true_steps or trial.budget.baseline_steps
        if on_truth and not system.can_learn_on_truth:
            raise ValueError(
                f"system {system.name}: learning on the true system needs two of it, one to be "
                "tested in: give a function that makes the environment as true"
            )
        return system

    def describe(self, config: Config) -> dict[str, Any]:
        """Plain settings behind the system of a trial."""
        shared = {field.name for field in dataclasses.fields(Trial)} - {"simulator"}
        return {name: config.get(name) for name in self.settings if name not in shared}
