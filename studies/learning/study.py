"""What sets one study of learning across the gap apart from another.

A study file says what is its own: the settings of a trial, the systems and the task, and how
its results are reported (``studies/pendulum_gap.py``). Everything else is beside this file.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from jsonargparse.typing import NonNegativeFloat
from sklearn.base import BaseEstimator

from policy.config import DDPGConfig
from residual import DropoutNet
from sims.simulator import Simulator
from studies.learning.budget import Budget
from studies.learning.earlier import ReplayRule
from studies.learning.problem import Problem

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
        corrected: A simulator with what it lacked, such as the corrected.yaml of find_gap: a
            policy is trained on it too, from the idealised one, without a true sample.
    """

    estimator: BaseEstimator = dataclasses.field(default_factory=DropoutNet)
    seed: int = 0
    budget: Budget = dataclasses.field(default_factory=Budget)
    ddpg: DDPGConfig = dataclasses.field(default_factory=DDPGConfig)
    caution: NonNegativeFloat = 0.0
    replay: ReplayRule = "first"
    corrected: Simulator | None = None


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
