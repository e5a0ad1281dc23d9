"""What was simulated while learning, to be learnt from again under a newer difference model.

A policy that learns on with an empty replay forgets: its critic meets a few hundred transitions
of one way to move, and the returns collapse before they recover. All transitions simulated so far
are still right once the newest difference is added to what the idealised simulator said, so they
are kept as it said them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from policy.ddpg import DDPG
from residual.corrected import CorrectedSimulator
from residual.difference import DifferenceModel
from sims.environment import SimulatorEnv, observe
from sims.simulator import Array

FILE = "simulated.npz"
_ROWS = 8192  # predicted at a time


class Recorder(gymnasium.Wrapper[Any, Any, Any, Any]):
    """A simulator's environment that keeps the transitions it goes through."""

    def __init__(self, env: SimulatorEnv) -> None:
        super().__init__(env)
        self._rows: list[tuple[Array, Array, Array]] = []
        self._state = np.zeros(0)

    def reset(self, **options: Any) -> tuple[Any, dict[str, Any]]:
        """As the environment's."""
        observation, info = self.env.reset(**options)
        self._state = info["state"]
        return observation, info

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """As the environment's."""
        step = self.env.step(action)
        following = step[-1]["state"]
        self._rows.append((self._state, np.array(action, float), following))
        self._state = following
        return step

    def save(self, path: Path, difference: DifferenceModel | None = None) -> None:
        """Write what the idealised simulator said, in single precision: learning needs no more.

        Args:
            path: Of the file.
            difference: Of the corrected simulator, if it was one: taken off again.
        """
        if not self._rows:
            return
        states, actions, following = (np.array(part) for part in zip(*self._rows, strict=True))
        if difference is not None:
            for part in _pieces(len(states)):
                following[part] -= difference.predict(states[part], actions[part])
        np.savez(
            path,
            states=states.astype(np.float32),
            actions=actions.astype(np.float32),
            next_states=following.astype(np.float32),
        )


def recorded(folders: Sequence[Path]) -> int:
    """Transitions in the ``simulated.npz`` of trainings."""
    total = 0
    for folder in folders:
        if (folder / FILE).exists():
            with np.load(folder / FILE, allow_pickle=False) as data:
                total += len(data["actions"])
    return total


def remember(
    agent: DDPG,
    env: SimulatorEnv,
    folders: Sequence[Path],
    again: bool = False,
    tell: Callable[[int], None] = lambda _: None,
) -> None:
    """Fill an agent's replay with all that was simulated, as ``env`` would have it.

    Args:
        agent: Gets the transitions.
        env: What the agent is to learn in; if its simulator is a corrected one, so are they.
        folders: Of the trainings whose ``simulated.npz`` are read, in their order.
        again: Simulate them again, for an ``env`` whose simulator is another than theirs.
        tell: Told how many are done.
    """
    low, high = agent.policy.low, agent.policy.high
    simulator, task = env.simulator, env.task
    done = 0
    for folder in folders:
        if not (folder / FILE).exists():  # it learnt nothing
            continue
        with np.load(folder / FILE, allow_pickle=False) as data:
            columns = [data[name].astype(float) for name in ("states", "actions", "next_states")]
        for part in _pieces(len(columns[0])):
            states, actions, following = (column[part] for column in columns)
            if again:
                following = simulator.step(states, actions)
            elif isinstance(simulator, CorrectedSimulator):
                following = simulator.correct(states, actions, following)
            agent.replay.extend(
                observe(simulator, states),
                2 * (actions - low) / (high - low) - 1,
                agent.config.reward_scale * task.reward(states, actions, following),
                observe(simulator, following),
                task.terminal(following),
            )
            done += len(states)
            tell(done)


def _pieces(count: int) -> list[slice]:
    return [slice(k, k + _ROWS) for k in range(0, count, _ROWS)]
