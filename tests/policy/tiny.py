"""Small environments for the tests."""

from __future__ import annotations

import gymnasium
import numpy as np


class Reach(gymnasium.Env):
    """A point on a line is pushed to the origin; best is to get there at once and stay.

    Args:
        length: Steps of an episode.
        terminal: End it as terminal and not as a time-out.
        actions: Number of actions; the first moves the point, bounds (-2, 1).
    """

    def __init__(self, length: int = 20, terminal: bool = False, actions: int = 1) -> None:
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (2,))
        self.action_space = gymnasium.spaces.Box(-2.0, 1.0, (actions,))
        self.length, self.terminal = length, terminal
        self.resets: list[int | None] = []

    def _observe(self):
        return np.array([self.x, self.v], np.float32), {"state": np.array([self.x, self.v])}

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.resets.append(seed)
        self.x, self.v, self.k = float(self.np_random.uniform(-1, 1)), 0.0, 0
        return self._observe()

    def step(self, action):
        assert self.action_space.contains(action), action
        self.v = 0.5 * self.v + 0.2 * float(action[0])
        self.x += self.v
        self.k += 1
        over = self.k == self.length
        observation, info = self._observe()
        reward = -abs(self.x)
        return observation, reward, over and self.terminal, over and not self.terminal, info
