"""Any simulator with a task as a Gymnasium environment."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import gymnasium
import numpy as np

from sims.render import Renderer, renderer_for
from sims.simulator import Array, Channel, Simulator, physical
from sims.tasks import Task
from sims.unsound import refuse_not_finite

# A state can leave any bound that is written down for it, and Gymnasium insists on a box.
_UNBOUNDED = np.inf


class SimulatorEnv(gymnasium.Env[np.ndarray, np.ndarray]):
    """A Gymnasium environment around a simulator and a task.

    Observation: for every state channel in order, an angle as its cosine and sine, anything
    else divided by the channel's scale; memory channels and those that the motion does not
    depend on are hidden. Action: in the units of the action channels. ``info["state"]`` holds
    the simulator's state, shape (n_s,), memory included; the task sees it without.

    Args:
        simulator: Nominal, true or corrected.
        task: Reward, termination and start states.
        render_mode: ``"rgb_array"`` or None.
        observed: Names of the state channels that the policy sees, in the simulator's order;
            by default all that are not hidden.

    Raises:
        ValueError: The simulator cannot be rendered but ``render_mode`` is given, or it lacks
            an observed channel.
    """

    def __init__(
        self,
        simulator: Simulator,
        task: Task,
        render_mode: str | None = None,
        observed: Collection[str] | None = None,
    ) -> None:
        if render_mode not in (None, "rgb_array"):
            raise ValueError(f"render_mode {render_mode!r} is not supported; use 'rgb_array'")
        self.simulator = simulator
        self.task = task
        self.render_mode = render_mode
        fps = max(1, round(1 / simulator.dt))
        self.metadata = {"render_modes": ["rgb_array"], "render_fps": fps}
        self._renderer: Renderer | None = renderer_for(simulator) if render_mode else None
        low = np.array([channel.low for channel in simulator.action_channels])
        high = np.array([channel.high for channel in simulator.action_channels])
        self._bounds = low, high
        self.action_space = gymnasium.spaces.Box(low, high, dtype=np.float64)
        self._observed = observed
        bounds = np.concatenate(
            [
                np.ones(2) if channel.angle else [_UNBOUNDED]
                for channel in observed_channels(simulator, observed)
            ]
        )
        self.observation_space = gymnasium.spaces.Box(-bounds, bounds, dtype=np.float64)
        self._state: Array = np.zeros(len(simulator.state_channels))
        self._steps = 0

    def __repr__(self) -> str:
        return f"SimulatorEnv({type(self.task).__name__} on {self.simulator.name})"

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode at a start state of the task, or at ``options["state"]``."""
        super().reset(seed=seed)
        start = self.task.start(self.np_random)
        if options and "state" in options:
            start = options["state"]
        state = np.asarray(start, float)[None]
        if state.shape[1] < len(self.simulator.state_channels):
            state = self.simulator.augment(state)
        self._state = state[0]
        self._steps = 0
        return self._observe(), {"state": self._state.copy()}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Hold ``action`` for one control period; a time-out is ``truncated``.

        Raises:
            Unsound: The state reached, or its reward, is not finite.
        """
        states = self._state[None]
        actions = np.clip(np.asarray(action, float)[None], *self._bounds)
        next_states = self.simulator.step(states, actions)
        rewards, ends = judged(self.simulator, self.task, states, actions, next_states)
        reward, terminated = float(rewards[0]), bool(ends[0])
        self._state = next_states[0]
        self._steps += 1
        truncated = self._steps >= self.task.horizon
        channels, name = self.simulator.state_channels, self.simulator.name
        refuse_not_finite(name, channels, self._state, self._steps, reward)
        return self._observe(), reward, terminated, truncated, {"state": self._state.copy()}

    def render(self) -> np.ndarray | None:
        """The present state as an RGB picture, shape (height, width, 3), or None."""
        return self._renderer.frame(self._state) if self._renderer else None

    def _observe(self) -> np.ndarray:
        return observe(self.simulator, self._state[None], self._observed)[0]


def judged(
    simulator: Simulator, task: Task, states: Array, actions: Array, next_states: Array
) -> tuple[Array, np.ndarray]:
    """What a task says of transitions: it is shown the physical channels, never hidden memory.

    Args:
        simulator: Its channels name the columns.
        task: Reward and termination.
        states, actions, next_states: shape (n, n_s), (n, n_a), (n, n_s).

    Returns:
        Rewards, shape (n,), and whether the episode has failed, shape (n,).
    """
    seen = len(physical(simulator.state_channels))
    reached = next_states[:, :seen]
    return task.reward(states[:, :seen], actions, reached), task.terminal(reached)


def observed_channels(
    simulator: Simulator, observed: Collection[str] | None = None
) -> tuple[Channel, ...]:
    """The state channels that a policy sees, see ``SimulatorEnv``."""
    channels = simulator.state_channels
    if observed is None:
        return tuple(c for c in channels if c.kind != "memory" and not c.invariant)
    names = [channel.name for channel in channels]
    unknown = ", ".join(name for name in observed if name not in names)
    if unknown:
        raise ValueError(f"there is no state channel {unknown} to observe; {', '.join(names)}")
    return tuple(channel for channel in channels if channel.name in observed)


def observe(simulator: Simulator, states: Array, observed: Collection[str] | None = None) -> Array:
    """What the policy sees of each state: shape (n, n_s) in, (n, n_observed) out."""
    seen = observed_channels(simulator, observed)
    columns = []
    for channel, column in zip(simulator.state_channels, states.T, strict=True):
        if channel not in seen:
            continue
        if channel.angle:
            columns += [np.cos(column), np.sin(column)]
        else:
            columns.append(column / channel.scale)
    return np.stack(columns, axis=1)
