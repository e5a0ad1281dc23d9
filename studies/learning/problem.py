"""What is to be learnt: two systems and a task, and how policies are tested on them."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from policy.evaluate import Rollout
from sims.environment import SimulatorEnv
from sims.simulator import Array, Simulator
from sims.tasks import Task


@dataclasses.dataclass(frozen=True)
class PolicyTests:
    """How policies are tested while they learn and afterwards, and where accuracy is measured.

    On a simulator tests are free; on the true system they are measurement and not counted, as
    in the paper.

    Args:
        every: Steps of learning on a simulator between tests.
        every_true: The same on the true system.
        episodes: Rollouts without noise per test, each from its own start state.
        noisy: Rollouts with a little noise per test on a model; they keep a policy from being
            chosen for one lucky path through the model's errors.
        finalists: So many of the best policies of a training are tested once more at its end.
        final_episodes: Rollouts of each of them, from other starts; 0 for no final.
        true_episodes: Rollouts of the policy kept on the true system: the result.
        visited_seconds: Accuracy is measured over the first seconds of fresh rollouts.
        visited_rollouts: How many of those.
        visited_stride: Open-loop predictions start at every so many-th state of them.
    """

    every: int = 500
    every_true: int = 250
    episodes: int = 1
    noisy: int = 3
    finalists: int = 1
    final_episodes: int = 0
    true_episodes: int = 1
    # Later a good policy balances, where there is next to nothing to predict.
    visited_seconds: float = 2.0
    visited_rollouts: int = 5
    visited_stride: int = 1


@dataclasses.dataclass(frozen=True)
class Problem:
    """A system to control and the simulator at hand.

    Attributes:
        description: What identifies all that follows: plain values only.
        idealised: The simulator that one has.
        true: The system that one wants to control; it is only ever sampled.
        task: Reward, start states, horizon.
        tests: How policies are tested.
        measures: What is reported of a rollout on the true system beside its return, by name.
        cold_sigma: Exploration noise of policies learnt from nothing; the others have the
            paper's. Slightly higher (paper, section IV-C), 0.20 in the authors' scripts.
        elsewhere: Draws states and actions of rollouts of the true system from anywhere, as
            ``residual.accuracy.uniform_rollouts``, which is used without it.
    """

    description: Mapping[str, Any]
    idealised: Simulator
    true: Simulator
    task: Task
    tests: PolicyTests = PolicyTests()
    measures: Callable[[Rollout], dict[str, float]] | None = None
    cold_sigma: float = 0.20
    elsewhere: Callable[[np.random.Generator], tuple[Array, Array]] | None = None

    def check_corrected(self, corrected: Simulator) -> None:
        """Raise ``ValueError`` unless a corrected simulator has the channels of the idealised one.

        Delay, lag and play have a memory, which is more state than the idealised one has.
        """
        for what in ("dt", "state_channels", "action_channels"):
            own, others = getattr(self.idealised, what), getattr(corrected, what)
            if own != others:
                told = [
                    f"{value:g} s" if what == "dt" else ", ".join(c.name for c in value)
                    for value in (others, own)
                ]
                raise ValueError(
                    f"corrected: {corrected.name} has {what.replace('_', ' ')} {told[0]}, expected "
                    f"{told[1]} as {self.idealised.name}; --simulator trains on any simulator"
                )

    def environment(self, simulator: Simulator) -> SimulatorEnv:
        """The task on ``simulator``."""
        return SimulatorEnv(simulator, self.task)
