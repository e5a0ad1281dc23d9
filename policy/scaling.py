"""Observations and rewards of a size that networks learn from, whatever their units."""

from __future__ import annotations

import dataclasses
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
# Sizes that networks learn from as they are.
_LEAST, _MOST = 0.1, 10.0
# A middle of so many spreads does not hide how a column changes.
_CENTRED = 2.0
_STEPS, _EPISODES = 2000, 8
# Less is rounding, and nothing that moved.
_MOVED = 1e-9
# Nothing that can be controlled goes so far.
_AWAY = 1e100
_NAMES = ("middle", "spread", "reward")


@dataclasses.dataclass(frozen=True)
class Scaling:
    """What a learner sees: ``(observation - middle) / spread``, and rewards times ``reward``.

    Args:
        middle, spread: In units of the observation, shape (n_o,).
        reward: Factor on rewards.

    Raises:
        ValueError: A number is not finite, a spread or the factor not positive, or shapes differ.
    """

    middle: Array
    spread: Array
    reward: float = 1.0

    def __post_init__(self) -> None:
        numbers = [*np.ravel(self.middle), *np.ravel(self.spread), self.reward]
        if np.shape(self.middle) != np.shape(self.spread) or not np.isfinite(numbers).all():
            raise ValueError("a scaling needs finite numbers, one middle and spread a column")
        if not (np.all(self.spread > 0) and self.reward > 0):
            raise ValueError("a scaling needs a spread and a factor above 0")

    @classmethod
    def none(cls, size: int) -> Scaling:
        """Everything as it is; ``size`` is n_o."""
        return cls(np.zeros(size), np.ones(size))

    @classmethod
    def measured(cls, env: gymnasium.Env[Any, Any], seed: int = 0) -> Scaling:
        """The scaling that an environment needs, by some episodes of random actions.

        Columns with finite bounds (cosine and sine of an angle) are left as they are, and so are
        a spread of 0.1 to 10, a middle of at most twice the spread, and rewards of that size:
        whoever chose their units knows better than random actions where a policy will go. All
        others come to spread 1 and middle 0 (far from it a network sees one large number and
        little of its changes), rewards to a root mean square of 1.

        Args:
            env: Stepped a few thousand times.
            seed: Of what is drawn.
        """
        observations, rewards = _random_episodes(env, seed)
        with np.errstate(over="ignore"):
            size = float(np.sqrt(np.mean(np.square(rewards))))
        if not (np.isfinite(size) and np.abs(observations).max() < _AWAY):
            raise ValueError(
                f"random actions drive {env.unwrapped!r} to an observation of "
                f"{np.abs(observations).max():.3g} and a reward of {np.abs(rewards).max():.3g}: it "
                "runs away; mend its equation (a sign, a unit), or end episodes before (terminal)"
            )
        box = env.observation_space
        assert isinstance(box, gymnasium.spaces.Box)
        bounded = np.isfinite(box.low) & np.isfinite(box.high)
        # What most of the time is seen: an unstable system ends far away, and is there briefly.
        low, middle, high = np.percentile(observations, [16, 50, 84], axis=0)
        spread = 0.5 * (high - low)
        spread = np.where(spread > _MOVED, spread, observations.std(axis=0))
        good = (spread >= _LEAST) & (spread <= _MOST)
        centred = good & (np.abs(middle) <= _CENTRED * spread)
        # A column that never moved, such as a set point, only loses its middle.
        moved = spread > _MOVED * np.maximum(np.abs(middle), 1.0)
        return cls(
            np.where(bounded | centred, 0.0, middle),
            np.where(bounded | good | ~moved, 1.0, spread),
            1.0 if _LEAST <= size <= _MOST or size == 0 else 1 / size,
        )

    def seen(self, observations: ArrayLike) -> Array:
        """Observations as the networks see them, shape (n_o,) or (n, n_o)."""
        return (np.asarray(observations, float) - self.middle) / self.spread

    def arrays(self) -> dict[str, NDArray[Any]]:
        """For a file, by name."""
        values = (self.middle, self.spread, np.array([self.reward]))
        return dict(zip(_NAMES, values, strict=True))

    @classmethod
    def taken_from(cls, arrays: dict[str, Any], size: int) -> Scaling:
        """Take it out of the arrays of a file; files of earlier versions hold none.

        Raises:
            ValueError: It is damaged.
        """
        if _NAMES[0] not in arrays:
            return cls.none(size)
        middle, spread, reward = (arrays.pop(name) for name in _NAMES)
        if np.shape(middle) != (size,) or np.shape(reward) != (1,):
            raise ValueError(f"its scaling is not one of {size} observations")
        return cls(np.asarray(middle, float), np.asarray(spread, float), float(reward[0]))


class ScaledEnv(gymnasium.Wrapper[Any, Any, Any, Any]):
    """An environment whose observations and rewards are scaled."""

    def __init__(self, env: gymnasium.Env[Any, Any], scaling: Scaling) -> None:
        super().__init__(env)
        self._scaling = scaling

    def reset(self, **options: Any) -> tuple[Any, dict[str, Any]]:
        """As the environment's."""
        observation, info = self.env.reset(**options)
        return self._scaling.seen(observation), info

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """As the environment's."""
        observation, reward, *ends, info = self.env.step(action)
        scaled = float(reward) * self._scaling.reward
        return self._scaling.seen(observation), scaled, bool(ends[0]), bool(ends[1]), info


def _random_episodes(env: gymnasium.Env[Any, Any], seed: int) -> tuple[Array, Array]:
    """Observations (n, n_o) and rewards (n,) of random actions, held for short and for long."""
    rng, box = np.random.default_rng(seed), env.action_space
    assert isinstance(box, gymnasium.spaces.Box)
    observations: list[Any] = []
    rewards: list[float] = []
    while len(rewards) < _STEPS:
        observation, _ = env.reset(seed=int(rng.integers(2**31)))
        observations.append(observation)
        begin, left, ended = len(rewards), 0, False
        while not ended and len(rewards) < begin + _STEPS // _EPISODES:
            if left == 0:
                action = rng.uniform(box.low, box.high)
                left = round(np.exp(rng.uniform(0, np.log(50))))
            left -= 1
            try:
                observation, reward, terminated, truncated, _ = env.step(action)
            except ValueError:  # It left its valid range, which training will tell.
                rewards.append(0.0)
                break
            observations.append(observation)
            rewards.append(float(reward))
            ended = terminated or truncated
    return np.array(observations, float), np.array(rewards)
