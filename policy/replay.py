"""Replay memory: the last transitions, in one preallocated tensor, sampled by index."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import ArrayLike


class Batch(NamedTuple):
    """Transitions as float32 tensors with one row each, views into one tensor.

    ``observations`` and ``next_observations`` have shape (n, n_o), ``actions`` (n, n_a),
    ``rewards`` and ``alive`` (n, 1). ``alive`` is 0 where the episode terminated in
    ``next_observations``, else 1; a time-out is not a termination.
    """

    observations: torch.Tensor
    actions: torch.Tensor
    rewards: torch.Tensor
    alive: torch.Tensor
    next_observations: torch.Tensor


class Replay:
    """The last ``capacity`` transitions; the oldest is overwritten first.

    A transition is one row of one tensor, so a batch is gathered in one call. Memory is
    ``4 * capacity * (2 n_o + n_a + 2)`` bytes, claimed from the system as it fills.

    Args:
        capacity: Number of transitions kept.
        observation_size: n_o.
        action_size: n_a.

    Raises:
        ValueError: ``capacity`` is not positive.
    """

    def __init__(self, capacity: int, observation_size: int, action_size: int) -> None:
        if capacity < 1:
            raise ValueError(f"capacity is {capacity}, expected at least one transition")
        self.capacity = capacity
        self.size = 0
        self.position = 0
        self._sizes = [observation_size, action_size, 1, 1, observation_size]
        self._rows = torch.empty(capacity, sum(self._sizes))
        # Numpy's views of the same memory: writing one row through torch costs several times more.
        edges = np.cumsum(self._sizes)[:-1]
        self._columns = np.split(self._rows.numpy(), edges, axis=1)

    def __len__(self) -> int:
        return self.size

    def add(
        self,
        observation: ArrayLike,
        action: ArrayLike,
        reward: float,
        next_observation: ArrayLike,
        terminated: bool,
    ) -> None:
        """Store one transition: shapes (n_o,), (n_a,), scalar, (n_o,), flag."""
        row = self.position
        observations, actions, rewards, alive, next_observations = self._columns
        observations[row] = observation
        actions[row] = action
        rewards[row] = reward
        alive[row] = not terminated
        next_observations[row] = next_observation
        self.position = (row + 1) % self.capacity
        self.size = max(self.size, row + 1)

    def sample(self, size: int, rng: np.random.Generator) -> Batch:
        """Draw ``size`` transitions uniformly, with replacement.

        Raises:
            ValueError: Nothing is stored yet.
        """
        if self.size == 0:
            raise ValueError("the replay is empty: add transitions before sampling from it")
        index = torch.from_numpy(rng.integers(self.size, size=size))
        return Batch(*self._rows.index_select(0, index).split(self._sizes, dim=1))

    def clear(self) -> None:
        """Forget all transitions."""
        self.size = self.position = 0

    def stored(self) -> torch.Tensor:
        """The rows in use, in memory order, shape (size, 2 n_o + n_a + 2): for saving."""
        return self._rows[: self.size]

    def restore(self, rows: torch.Tensor, position: int) -> None:
        """Take over rows from ``stored`` and the place of the next write.

        Raises:
            ValueError: The rows do not fit in width or number.
        """
        width = sum(self._sizes)
        if rows.ndim != 2 or rows.shape[1] != width or len(rows) > self.capacity:
            raise ValueError(
                f"stored transitions have shape {tuple(rows.shape)}, expected at most "
                f"{self.capacity} rows of {width}, the sizes that this replay was made for"
            )
        self.size = len(rows)
        self.position = position
        self._rows[: self.size] = rows
