"""Tasks: what is asked of a system - reward, termination, start states and horizon."""

from __future__ import annotations

import abc
import dataclasses
from typing import Literal

import numpy as np

from sims.simulator import Array, wrap


class Task(abc.ABC):
    """A task on top of a simulator; rewards are computed on the state the system reached.

    States have the physical channels in order, n_s of them. The hidden memory of effects, such as
    the commands that a delay holds back, is not shown to tasks.

    Attributes:
        horizon: Steps after which an episode is cut (a time-out, not a failure).
    """

    horizon: int

    def __repr__(self) -> str:
        return f"{type(self).__name__}(horizon={getattr(self, 'horizon', None)})"

    @abc.abstractmethod
    def start(self, rng: np.random.Generator) -> Array:
        """A start state, shape (n_s,)."""

    @abc.abstractmethod
    def reward(self, states: Array, actions: Array, next_states: Array) -> Array:
        """Reward of every transition, rows in, shape (n,) out."""

    def terminal(self, next_states: Array) -> np.ndarray:
        """True where an episode has failed, shape (n,); by default never."""
        return np.zeros(len(next_states), dtype=bool)


@dataclasses.dataclass(frozen=True)
class SwingUp(Task):
    """Swing the pendulum up and balance it: r = -5 phi'^2 - 0.1 phidot'^2 - 0.01 a^2.

    phi' is the angle reached, wrapped to [-pi, pi), 0 upright (paper, section IV-A).

    Args:
        horizon: Steps per episode; 400 steps of 0.05 s are the paper's 20 s.
        start_at: ``"hanging"`` starts at (pi, 0) as the paper does, ``"anywhere"``
            uniformly with |phi| <= pi and |phidot| <= 1 rad/s.
    """

    horizon: int = 400
    start_at: Literal["hanging", "anywhere"] = "hanging"

    def start(self, rng: np.random.Generator) -> Array:
        """Start state (phi, phidot) in rad and rad/s."""
        if self.start_at == "hanging":
            return np.array([np.pi, 0.0])
        return rng.uniform([-np.pi, -1.0], [np.pi, 1.0])

    def reward(self, states: Array, actions: Array, next_states: Array) -> Array:
        """Reward per step (dimensionless); columns of states: phi, phidot; of actions: V."""
        angle, rate = wrap(next_states[:, 0]), next_states[:, 1]
        return -5 * angle**2 - 0.1 * rate**2 - 0.01 * actions[:, 0] ** 2
