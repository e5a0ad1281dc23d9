"""A true system that is somebody else's environment: stepped and reset, never set to a state."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import ArrayLike

from sims.environment import observe
from sims.simulator import Array, Simulator, wrap
from sims.tasks import Task
from sims.unsound import Unsound, answered, cannot_call, refuse_not_finite

#: Reads the state, shape (n_s,), from the environment and its last observation.
StateOf = Callable[[Any, Any], ArrayLike]

# Start states of a task that tell where they usually are, and the part of a channel's scale by
# which an environment may begin elsewhere.
_STARTS, _NEARBY = 20, 0.1

_log = logging.getLogger("simgap")
# What was logged of which environment: every training makes a new one.
_logged: set[tuple[str, str]] = set()


class SampledEnv(gymnasium.Env[np.ndarray, np.ndarray]):
    """Another library's environment under our task, seen as the nominal simulator is seen.

    Rewards are the task's, of the states reached; an episode ends where the task or the
    environment ends it. Angles begin within half a turn of the middle of the task's own start
    states, and are continued over whole turns. Where the environment begins elsewhere than the
    task, or ends an episode early without saying that it is terminated, a warning says so once.

    Args:
        env: Reports its state in ``info["state"]``, or ``state_of`` reads it.
        nominal: Its channels name the columns of the state and the actions.
        task: Reward, termination and horizon; start states are the environment's own.
        state_of: Reads the state from the environment and its observation.

    Attributes:
        said: The first warning of each kind about it.

    Raises:
        Unsound: The actions or the control period are not those of ``nominal``; later, the state
            does not fit its channels, or is not finite, or a function of the environment raised.
    """

    def __init__(
        self,
        env: gymnasium.Env[Any, Any],
        nominal: Simulator,
        task: Task,
        state_of: StateOf | None = None,
    ) -> None:
        self.env, self.nominal, self.task, self._state_of = env, nominal, task, state_of
        low = np.array([channel.low for channel in nominal.action_channels])
        high = np.array([channel.high for channel in nominal.action_channels])
        self.action_space = gymnasium.spaces.Box(low, high, dtype=np.float64)
        width = observe(nominal, np.zeros((1, len(nominal.state_channels)))).shape[1]
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (width,), np.float64)
        box = env.action_space
        fits = (
            isinstance(box, gymnasium.spaces.Box)
            and box.shape == low.shape
            and np.allclose(box.low, low)
            and np.allclose(box.high, high)
        )
        if not fits:
            names = ", ".join(
                f"{c.name} from {c.low:g} to {c.high:g}{c.unit_text}"
                for c in nominal.action_channels
            )
            mend = "wrap the environment (gymnasium.wrappers.RescaleAction) or change the channels"
            if not isinstance(box, gymnasium.spaces.Box):
                mend = "policies act in a Box, so wrap it in one that takes continuous actions"
            raise Unsound(
                f"the true environment's actions are {box}, those of {nominal.name} {names}: {mend}"
            )
        _refuse_early_end(env, task)
        _refuse_call(env.unwrapped.reset, "reset(seed=, options=)", seed=0, options=None)
        if state_of is not None:
            _refuse_call(state_of, "state_of(env, observation)", env, None)
        period = getattr(env.unwrapped, "dt", None)
        number = isinstance(period, int | float | np.number) and not isinstance(period, bool)
        if number and not np.isclose(period, nominal.dt):  # type: ignore[arg-type]
            raise Unsound(
                f"the true environment's control period is {period:g} s, that of {nominal.name} "
                f"{nominal.dt:g} s: make them one, such as by dt of the simulator"
            )
        self._name = f"the true environment {type(env.unwrapped).__name__}"
        self._angles = np.array([channel.angle for channel in nominal.state_channels])
        self._lowest, self._highest = _starts(task, len(self._angles))
        self._state: Array = np.zeros(0)
        self._steps = 0
        self.said: dict[str, str] = {}

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode where the environment begins it."""
        super().reset(seed=seed)
        begun = answered(f"{self._name} in reset", self.env.reset, seed=seed, options=options)
        if not isinstance(begun, tuple) or len(begun) != 2:
            raise Unsound(
                f"{self._name}: reset returned {type(begun).__name__}, expected Gymnasium's two: "
                "observation, info"
            )
        observation, info = begun
        self._steps = 0
        start = self._read(observation, info)
        middle = 0.5 * (self._lowest + self._highest)
        self._state = np.where(self._angles, middle + wrap(start - middle), start)
        self._compare_start()
        return observe(self.nominal, self._state[None])[0], {"state": self._state.copy()}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Hold ``action`` for one control period."""
        box = self.action_space
        assert isinstance(box, gymnasium.spaces.Box)
        held = np.clip(np.asarray(action, float), box.low, box.high)
        dtype = self.env.action_space.dtype
        stepped = answered(f"{self._name} in step", self.env.step, held.astype(dtype))
        if not isinstance(stepped, tuple | list) or len(stepped) != 5:
            several = isinstance(stepped, tuple | list)
            what = f"{len(stepped)} values" if several else type(stepped).__name__
            raise Unsound(
                f"{self._name}: step returned {what}, expected Gymnasium's five: "
                "observation, reward, terminated, truncated, info"
            )
        observation, _, ended, cut, info = stepped
        self._steps += 1
        reached = self._read(observation, info)
        turned = wrap(reached - self._state)
        reached = np.where(self._angles, self._state + turned, reached)
        before, after = self._state[None], reached[None]
        reward = float(self.task.reward(before, held[None], after)[0])
        terminated = bool(ended or self.task.terminal(after)[0])
        refuse_not_finite(self._name, self.nominal.state_channels, reached, self._steps, reward)
        self._state = reached
        truncated = bool(cut or self._steps >= self.task.horizon)
        if cut and not terminated and self._steps < self.task.horizon:
            self._warn(
                "end",
                f"ended an episode after {self._steps} of {self.task.horizon} steps "
                "without terminating it: its returns are sums over fewer steps than those on "
                "the simulator; let the task end there too (terminal), or give it "
                f"horizon={self._steps}",
            )
        seen = observe(self.nominal, after)[0]
        return seen, reward, terminated, truncated, {"state": reached.copy()}

    def render(self) -> Any:
        """As the environment shows itself."""
        return self.env.render()

    def close(self) -> None:
        """End the environment."""
        self.env.close()

    def _compare_start(self) -> None:
        """Say where an episode begins far from all starts of the task."""
        low, high = self._lowest, self._highest
        channels = self.nominal.state_channels
        slack = high - low + _NEARBY * np.array([channel.scale for channel in channels])
        far = (self._state < low - slack) | (self._state > high + slack)
        if far.any():
            c = int(np.argmax(far))
            name, unit = channels[c].name, channels[c].unit
            self._warn(
                "start",
                f"begins episodes at {name} {self._state[c]:.3g} {unit}, the task "
                f"from {low[c]:.3g} to {high[c]:.3g} {unit}: policies learn from other starts "
                "than they are tested at; let start of the task draw what reset gives",
            )

    def _warn(self, what: str, says: str) -> None:
        """Warn of something about the environment, and log the same no second time."""
        warning = f"{self._name} {says}"
        self.said.setdefault(what, warning)
        if (self._name, what) not in _logged:
            _logged.add((self._name, what))
            _log.warning("%s", warning)

    def _read(self, observation: Any, info: dict[str, Any]) -> Array:
        if self._state_of is not None:
            whose = f"the function state_of for {self._name}"
            given = answered(whose, self._state_of, self.env, observation)
            what = "state_of returned"
        elif isinstance(info, Mapping) and "state" in info:
            given, what = info["state"], "info['state'] is"
        else:
            raise Unsound(
                "the true environment does not report its state: put it into info['state'], or "
                "give the System a function state_of(env, observation)"
            )
        state = _numbers(given)
        if state is None:
            names = ", ".join(channel.name for channel in self.nominal.state_channels)
            raise Unsound(f"{self._name}: {what} {given!r:.80}, expected one real number for "
                          f"each of {names}")  # fmt: skip
        channels = self.nominal.state_channels
        if state.shape != (len(channels),):
            names = ", ".join(channel.name for channel in channels)
            raise Unsound(
                f"the true environment's state has shape {state.shape}, expected "
                f"({len(channels)},): {names}"
            )
        refuse_not_finite(self._name, channels, state, self._steps)
        return state


def _numbers(given: Any) -> Array | None:
    """What somebody gave as an array of real numbers; None if it is no such thing."""
    try:
        found = np.asarray(given)
        # Numbers of other libraries are objects here.
        return None if found.dtype.kind not in "biufO" else found.astype(float)
    except Exception:
        return None


def _refuse_early_end(env: gymnasium.Env[Any, Any], task: Task) -> None:
    """Refuse a time limit below the task's horizon: returns of both would not compare."""
    limit = env.spec.max_episode_steps if env.spec is not None else None
    if limit is not None and limit < task.horizon:
        raise Unsound(
            f"the true environment ends episodes after {limit} steps, the task after "
            f"{task.horizon}: give gymnasium.make(..., max_episode_steps={task.horizon}), or the "
            f"task horizon={limit}"
        )


def _refuse_call(function: Callable[..., Any], such_as: str, *given: Any, **named: Any) -> None:
    """Refuse a function that cannot be called as it will be."""
    if why := cannot_call(function, *given, **named):
        raise Unsound(
            f"the true environment cannot be asked for {such_as}: {why}; give its function "
            "these arguments"
        )


def _starts(task: Task, width: int) -> tuple[Array, Array]:
    """The ends of where episodes of a task start, each (n_s,)."""
    starts = [task.start(np.random.default_rng(seed))[:width] for seed in range(_STARTS)]
    return np.min(starts, axis=0), np.max(starts, axis=0)
