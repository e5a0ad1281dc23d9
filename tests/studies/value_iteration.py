"""The best return a pendulum allows: value iteration on a fine grid of states.

No learning method can beat it by more than the grid's error, so it stands in the tables as
the physical limit. Needs the simulator's equations, which a learner never sees.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from sims.simulator import Array, Simulator, wrap
from sims.tasks import Task


@dataclasses.dataclass(frozen=True)
class GridPolicy:
    """Greedy look-ahead on the value function of a two-state pendulum.

    Attributes:
        simulator, task: What is controlled.
        angles, rates: Grid, rad and rad/s.
        values: Value on the grid, shape (len(angles), len(rates)).
        gamma: Discount.
    """

    simulator: Simulator
    task: Task
    angles: Array
    rates: Array
    values: Array
    gamma: float

    def act(self, state: Array, candidates: int = 121) -> Array:
        """The best of evenly spaced actions at ``state`` (n_s,), shape (n_a,)."""
        channel = self.simulator.action_channels[0]
        actions = np.linspace(channel.low, channel.high, candidates)[:, None]
        states = np.tile(state, (candidates, 1))
        reached = self.simulator.step(states, actions)
        rows, weights = _interpolation(self.angles, self.rates, reached)
        ahead = (self.values.ravel()[rows] * weights).sum(1)
        reward = self.task.reward(states, actions, reached)
        return actions[np.argmax(reward + self.gamma * ahead)]


def value_iteration(
    simulator: Simulator,
    task: Task,
    angles: int = 361,
    rates: int = 301,
    fastest: float = 30.0,
    actions: int = 25,
    gamma: float = 0.99,
    tolerance: float = 1e-3,
) -> GridPolicy:
    """Solve a pendulum (angle, rate; one input) to the grid's accuracy.

    Args:
        simulator: Advances states of two channels; a vectorised one is many times faster.
        task: Its reward; episodes are taken as endless.
        angles, rates, actions: Number of grid points.
        fastest: Largest rate on the grid, rad/s.
        gamma: Discount.
        tolerance: Stop when no value moves by more.

    Returns:
        The greedy policy on the converged values.
    """
    angle_grid = np.linspace(-np.pi, np.pi, angles)
    rate_grid = np.linspace(-fastest, fastest, rates)
    states = np.stack(np.meshgrid(angle_grid, rate_grid, indexing="ij"), -1).reshape(-1, 2)
    channel = simulator.action_channels[0]
    rewards, rows, weights = [], [], []
    for action in np.linspace(channel.low, channel.high, actions):
        held = np.full((len(states), 1), action)
        reached = simulator.step(states, held)
        rewards.append(task.reward(states, held, reached))
        row, weight = _interpolation(angle_grid, rate_grid, reached)
        rows.append(row)
        weights.append(weight.astype(np.float32))
    values = np.zeros(len(states))
    everyone = np.arange(len(states))
    while True:
        # Modified policy iteration: one full improvement, then cheap sweeps of its policy.
        backed_up = np.stack(
            [
                reward + gamma * (values[row] * weight).sum(1)
                for reward, row, weight in zip(rewards, rows, weights, strict=True)
            ]
        )
        best = backed_up.argmax(0)
        improved = backed_up[best, everyone]
        change = np.abs(improved - values).max()
        values = improved
        if change < tolerance:
            break
        reward = np.stack(rewards)[best, everyone]
        row = np.stack(rows)[best, everyone]
        weight = np.stack(weights)[best, everyone]
        for _ in range(60):
            values = reward + gamma * (values[row] * weight).sum(1)
    return GridPolicy(simulator, task, angle_grid, rate_grid, values.reshape(angles, rates), gamma)


def episode_return(policy: GridPolicy, system: Simulator, start: Array) -> float:
    """Undiscounted return of one episode of the policy's task on ``system``."""
    state, total = np.asarray(start, float), 0.0
    for _ in range(policy.task.horizon):
        action = policy.act(state)
        reached = system.step(state[None], action[None])
        total += float(policy.task.reward(state[None], action[None], reached)[0])
        state = reached[0]
    return total


def _interpolation(angles: Array, rates: Array, states: Array) -> tuple[np.ndarray, Array]:
    """Bilinear interpolation: flat grid rows (n, 4) and their weights (n, 4)."""
    angle = (wrap(states[:, 0]) - angles[0]) / (angles[1] - angles[0])
    rate = np.clip((states[:, 1] - rates[0]) / (rates[1] - rates[0]), 0, len(rates) - 1)
    i = np.minimum(angle.astype(int), len(angles) - 2)
    j = np.minimum(rate.astype(int), len(rates) - 2)
    x, y = angle - i, rate - j
    rows = i[:, None] * len(rates) + j[:, None] + np.array([0, 1, len(rates), len(rates) + 1])
    weights = np.stack([(1 - x) * (1 - y), (1 - x) * y, x * (1 - y), x * y], axis=1)
    return rows, weights
