"""A task that pays less where the difference model is unsure.

A difference model is wrong where it has no data, and a policy learnt on it goes there if the
error looks profitable (paper, section VI). The remedy here is a penalty on the model's own
standard deviation, as in model-based offline learning (Yu et al., MOPO, NeurIPS 2020, eq. 5).
"""

from __future__ import annotations

import dataclasses
from typing import Self

import numpy as np

from residual.difference import DifferenceModel
from residual.trajectories import Transitions
from sims.simulator import Array
from sims.tasks import Task


@dataclasses.dataclass(frozen=True)
class PenalisedTask(Task):
    """A task whose reward falls as the difference model becomes less sure than on its data.

    r - weight * max(0, u - 1), where u is the standard deviation of the predicted difference
    over its typical size on the training rows, averaged over the channels.

    Args:
        task: What is asked of the system.
        difference: The model whose spread is used.
        typical: That size, shape (n_s,).
        weight: Reward lost per step for each multiple of the typical spread.
    """

    task: Task
    difference: DifferenceModel
    typical: Array
    weight: float

    @classmethod
    def around(
        cls, task: Task, difference: DifferenceModel, data: Transitions, weight: float
    ) -> Self:
        """A penalised task that knows the typical spread from the rows fitted to.

        Raises:
            ValueError: The estimator predicts no standard deviation.
        """
        _, std = difference.predict(data.states, data.actions, return_std=True)
        if std is None:
            raise ValueError(
                f"{type(difference.estimator).__name__} predicts no standard deviation, which "
                "uncertainty_penalty needs: use an estimator with predict(X, return_std=True), or 0"
            )
        typical = np.median(std, axis=0)
        return cls(task, difference, np.where(typical > 0, typical, np.inf), weight)

    @property
    def horizon(self) -> int:  # type: ignore[override]
        """As the task's."""
        return self.task.horizon

    def start(self, rng: np.random.Generator) -> Array:
        """As the task's."""
        return self.task.start(rng)

    def terminal(self, next_states: Array) -> np.ndarray:
        """As the task's."""
        return self.task.terminal(next_states)

    def reward(self, states: Array, actions: Array, next_states: Array) -> Array:
        """The task's reward less the penalty, shape (n,)."""
        _, std = self.difference.predict(states, actions, return_std=True)
        assert std is not None
        excess = np.maximum(0.0, (std / self.typical).mean(axis=1) - 1.0)
        return self.task.reward(states, actions, next_states) - self.weight * excess
