"""Run a policy without learning: rollouts with everything recorded, returns, and data sets."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable
from typing import Any, Protocol

import gymnasium
import numpy as np
from numpy.typing import ArrayLike, NDArray

from policy.noise import OrnsteinUhlenbeck

Array = NDArray[np.float64]


class Acting(Protocol):
    """Anything that maps an observation to an action of the environment."""

    def act(self, observation: ArrayLike) -> NDArray[Any]:
        """Action, shape (n_a,), for one observation, shape (n_o,)."""


class Predicting(Protocol):
    """The same as other libraries call it, such as Stable-Baselines3."""

    def predict(self, observation: Any) -> Any:
        """Action, shape (n_a,), or a tuple that begins with it."""


Policy = Acting | Predicting


def action_of(policy: Policy, observation: ArrayLike) -> NDArray[Any]:
    """The action of a policy with ``act``, or with ``predict``; without noise if it can be told.

    Args:
        policy: With either method.
        observation: shape (n_o,).

    Returns:
        shape (n_a,).

    Raises:
        TypeError: It has neither.
    """
    if act := getattr(policy, "act", None):
        return act(observation)
    predict = getattr(policy, "predict", None)
    if predict is None:
        raise TypeError(
            f"a {type(policy).__name__} is no policy: give it act(observation), or "
            "predict(observation) as in Stable-Baselines3"
        )
    quiet = "deterministic" in inspect.signature(predict).parameters
    found = predict(observation, deterministic=True) if quiet else predict(observation)
    return np.asarray(found[0] if isinstance(found, tuple) else found)


@dataclasses.dataclass(frozen=True)
class Rollout:
    """One episode of T steps.

    Args:
        observations: shape (T + 1, n_o), the first being the start.
        actions: As applied, noise included and clipped to the bounds, shape (T, n_a).
        rewards: shape (T,).
        states: The environment's ``info["state"]``, shape (T + 1, n_s), or None without it.
        terminated: The episode ended in a terminal state and not by time.
        measured: The environment's ``info["measured"]``, shape (T + 1, n_s), or None without it.
    """

    observations: Array
    actions: Array
    rewards: Array
    states: Array | None
    terminated: bool
    measured: Array | None = None

    def __repr__(self) -> str:
        end = "terminated" if self.terminated else "cut by time"
        return f"Rollout({len(self.rewards)} steps, return {self.total:.5g}, {end})"

    @property
    def total(self) -> float:
        """Undiscounted return."""
        return float(self.rewards.sum())


def rollout(
    policy: Policy,
    env: gymnasium.Env[Any, Any],
    seed: int,
    noise: OrnsteinUhlenbeck | None = None,
    max_steps: int | None = None,
) -> Rollout:
    """One episode from ``env.reset(seed=seed)`` to its end.

    Args:
        policy: Chooses the actions.
        env: Environment with a bounded box of actions if there is noise.
        seed: Seed of the reset.
        noise: Exploration noise in units of the action normalised to [-1, 1]; it is reset
            at the start.
        max_steps: Stop after so many steps.
    """
    box = env.action_space
    assert isinstance(box, gymnasium.spaces.Box)
    half = (np.asarray(box.high, float) - np.asarray(box.low, float)) / 2
    if noise:
        noise.reset()
    observation, info = env.reset(seed=seed)
    observations, infos = [observation], [info]
    actions: list[NDArray[Any]] = []
    rewards: list[float] = []
    terminated = truncated = False
    while not (terminated or truncated or len(rewards) == max_steps):
        action = action_of(policy, observation)
        if noise:
            action = np.clip(action + half * noise(), box.low, box.high).astype(box.dtype)
        observation, reward, terminated, truncated, info = env.step(action)
        observations.append(observation)
        infos.append(info)
        actions.append(action)
        rewards.append(float(reward))
    states, measured = (
        np.array([info[key] for info in infos], float) if key in infos[0] else None
        for key in ("state", "measured")
    )
    return Rollout(
        np.array(observations, float),
        np.array(actions, float).reshape(len(actions), -1),
        np.array(rewards),
        states,
        bool(terminated),
        measured,
    )


def evaluate(
    policy: Policy,
    env: gymnasium.Env[Any, Any],
    episodes: int = 1,
    seed: int = 0,
    noise: OrnsteinUhlenbeck | None = None,
) -> Array:
    """Undiscounted returns of ``episodes`` rollouts with seeds from ``seed`` on, (episodes,)."""
    return np.array([rollout(policy, env, seed + k, noise).total for k in range(episodes)])


#: Rolls out one episode, as ``rollout`` does.
Roll = Callable[
    [Policy, gymnasium.Env[Any, Any], int, OrnsteinUhlenbeck | None, int | None], Rollout
]


def collect(
    policy: Policy,
    env: gymnasium.Env[Any, Any],
    samples: int,
    seed: int,
    noise: OrnsteinUhlenbeck | None = None,
    roll: Roll = rollout,
    tell: Callable[[int], None] | None = None,
) -> list[Rollout]:
    """Rollouts with exactly ``samples`` steps in all, the last one cut short if need be.

    Args:
        policy, env, seed, noise: See ``rollout``; seeds count on.
        samples: How many steps.
        roll: Rolls out each.
        tell: Told after each how many steps there are.
    """
    rollouts: list[Rollout] = []
    taken = 0
    while taken < samples:
        rollouts.append(roll(policy, env, seed + len(rollouts), noise, samples - taken))
        taken += len(rollouts[-1].rewards)
        if tell:
            tell(taken)
    return rollouts
