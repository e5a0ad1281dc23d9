"""Replay memory: the last transitions, in one preallocated array, sampled by index."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float32]


class Batch(NamedTuple):
    """Transitions as float32 arrays with one row each, views into one array.

    ``observations`` and ``next_observations`` have shape (n, n_o), ``actions`` (n, n_a),
    ``rewards`` and ``alive`` (n, 1). ``alive`` is 0 where the episode terminated in
    ``next_observations``, else 1; a time-out is not a termination.
    """

    observations: Array
    actions: Array
    rewards: Array
    alive: Array
    next_observations: Array


class Seen(NamedTuple):
    """n transitions of an environment, for an algorithm to learn from.

    ``observations`` and ``next_observations`` have shape (n, n_o), ``actions``, in the units of
    the action space, (n, n_a), ``rewards`` and ``terminated``, whether the episode ended there
    and not by time, (n,).
    """

    observations: ArrayLike
    actions: ArrayLike
    rewards: ArrayLike
    next_observations: ArrayLike
    terminated: ArrayLike


class Replay:
    """The last ``capacity`` transitions; the oldest is overwritten first.

    A transition is one row of one array, so a batch is gathered in one call. Memory is
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
        self._rows = np.empty((capacity, sum(self._sizes)), np.float32)
        ends = np.cumsum(self._sizes).tolist()
        self._parts = [slice(end - size, end) for size, end in zip(self._sizes, ends, strict=True)]
        self._columns = [self._rows[:, part] for part in self._parts]

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

    def extend(
        self,
        observations: ArrayLike,
        actions: ArrayLike,
        rewards: ArrayLike,
        next_observations: ArrayLike,
        terminated: ArrayLike,
    ) -> None:
        """Store n transitions in order: shapes (n, n_o), (n, n_a), (n,), (n, n_o), (n,)."""
        alive = ~np.asarray(terminated, bool)
        parts = (observations, actions, rewards, alive, next_observations)
        count = len(alive)
        rows = (self.position + np.arange(count)) % self.capacity
        # Of more than fit the last remain.
        kept = slice(max(count - self.capacity, 0), None)
        for column, part in zip(self._columns, parts, strict=True):
            column[rows[kept]] = np.reshape(part, (count, -1))[kept]
        self.size = min(self.size + count, self.capacity)
        self.position = (self.position + count) % self.capacity

    def sample(self, size: int, rng: np.random.Generator) -> Batch:
        """Draw ``size`` transitions uniformly, with replacement.

        Raises:
            ValueError: Nothing is stored yet.
        """
        if self.size == 0:
            raise ValueError("the replay is empty: add transitions before sampling from it")
        rows = self._rows[rng.integers(self.size, size=size)]
        return Batch(*[rows[:, part] for part in self._parts])

    def clear(self) -> None:
        """Forget all transitions."""
        self.size = self.position = 0

    def stored(self) -> Array:
        """The rows in use, in memory order, shape (size, 2 n_o + n_a + 2): for saving."""
        return self._rows[: self.size]

    def restore(self, rows: Array, position: int) -> None:
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
