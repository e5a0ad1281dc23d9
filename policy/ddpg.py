"""Deep deterministic policy gradient (Lillicrap et al., 2016) for one core, without autograd."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import ArrayLike, NDArray

from policy.actor_critic import ActorCritic, check_sizes
from policy.config import DDPGConfig, whole
from policy.files import content_of, read_arrays, write_arrays
from policy.mlp import MlpPolicy
from policy.noise import OrnsteinUhlenbeck
from policy.observations import StateColumns
from policy.replay import Replay, Seen
from policy.scaling import Scaling
from policy.spaces import check_spaces, one_box

FORMAT = "simgap.ddpg.1"


@dataclasses.dataclass(frozen=True)
class Progress:
    """Where ``DDPG.learn`` stands.

    Args:
        step: Steps taken in this call.
        steps: Steps asked for in this call.
        returns: Undiscounted return of each finished episode of this call, noise included.
    """

    step: int
    steps: int
    returns: tuple[float, ...]


Callback = Callable[[Progress], bool | None]


class DDPG:
    """An agent that learns a deterministic policy in any environment with box spaces.

    What it learns stays with it: a second ``learn``, in another environment with spaces of the
    same size, continues from the current networks, optimisers and replay. Everything follows
    from ``seed``; no global random state is read or written.

    Args:
        observation_space: One-dimensional ``Box``, n_o observations.
        action_space: One-dimensional bounded ``Box``, n_a actions.
        config: Settings.
        seed: Seed of the initial weights, the noise, the batches and the environment's resets.
        scaling: Of what the networks see; by default none.
        columns: Of the states that observations are made of, for the policy's ``act_on``.

    Attributes:
        policy: The current deterministic policy, a live view: it changes as the agent learns.
        replay: The transitions seen.

    Raises:
        ValueError: A space is not a box as described.
    """

    def __init__(
        self,
        observation_space: gymnasium.Space[Any],
        action_space: gymnasium.Space[Any],
        config: DDPGConfig | None = None,
        seed: int = 0,
        scaling: Scaling | None = None,
        columns: StateColumns | None = None,
    ) -> None:
        n_o = one_box("observation_space", observation_space).shape[0]
        box = one_box("action_space", action_space)
        if not box.is_bounded():
            raise ValueError(f"action_space is {box}, expected finite bounds: the noise needs them")
        n_a = box.shape[0]
        self.config = c = config or DDPGConfig()
        self._rng = rng = np.random.default_rng(seed)
        self.scaling = scaling or Scaling.none(n_o)
        self._networks = ActorCritic(n_o, n_a, c, rng)
        self._noise = OrnsteinUhlenbeck(n_a, c.noise_sigma, c.noise_theta, rng)
        self.replay = Replay(c.replay, n_o, n_a)
        self.policy = MlpPolicy(
            self._networks.actor.layers(),
            np.asarray(box.low, np.float32),
            np.asarray(box.high, np.float32),
            scaling,
            columns,
        )

    @classmethod
    def for_env(
        cls,
        env: gymnasium.Env[Any, Any],
        config: DDPGConfig | None = None,
        seed: int = 0,
        scaling: Scaling | None = None,
        columns: StateColumns | None = None,
    ) -> DDPG:
        """An agent for the spaces of ``env``; errors as for the class."""
        return cls(env.observation_space, env.action_space, config, seed, scaling, columns)

    def __repr__(self) -> str:
        return f"DDPG({self.policy!r}, {self.updates} updates, {len(self.replay)} transitions)"

    def act(self, observation: ArrayLike, noise: bool = False) -> NDArray[np.float32]:
        """The policy's action, within the bounds.

        Args:
            observation: shape (n_o,), or (n, n_o) without noise.
            noise: Add the next value of the exploration noise.

        Returns:
            Shape (n_a,) or (n, n_a).

        Raises:
            ValueError: The shape does not fit, or noise is asked for a batch: it has a memory
                of one episode.
        """
        if not noise:
            return self.policy.act(observation)
        return self.policy.to_action(self._explore(observation))

    def learn(
        self,
        env: gymnasium.Env[Any, Any],
        steps: int,
        callback: Callback | None = None,
        every: int = 1000,
        random_steps: int = 0,
    ) -> None:
        """Act in ``env`` for ``steps`` steps and learn from every one.

        An episode starts with this call and after every end of one. A terminated episode has
        no value beyond its end; one that was only truncated (a time-out) keeps the value of its
        last state.

        Args:
            env: Environment with spaces of the sizes that the agent was made for.
            steps: Steps of the environment.
            callback: Called after each ``every`` steps and after the last; learning stops
                if it returns True.
            every: See ``callback``.
            random_steps: The first steps of this call take uniformly random actions: an agent
                that knows nothing yet sees more of the system than its own noise would show.

        Raises:
            ValueError: The spaces do not fit.
            FloatingPointError: The environment gave an observation or a reward that is not
                finite.
        """
        check_spaces(env, self.policy.observation_size, len(self.policy.low))
        c, seen = self.config, self.scaling.seen
        factor = c.reward_scale * self.scaling.reward
        returns: list[float] = []
        total = 0.0
        observation, _ = env.reset(seed=int(self._rng.integers(2**31)))
        self._noise.reset()
        for step in range(1, steps + 1):
            if step <= random_steps:
                normalised = self._rng.uniform(-1.0, 1.0, len(self.policy.low))
            else:
                normalised = self._explore(observation)
            following, reward, terminated, truncated, _ = env.step(
                self.policy.to_action(normalised)
            )
            if not (math.isfinite(float(reward)) and np.isfinite(following).all()):
                raise FloatingPointError(
                    f"step {step} gave the observation {following} and the reward {reward}: "
                    "the environment has left its valid range"
                )
            scaled = factor * float(reward)
            self.replay.add(seen(observation), normalised, scaled, seen(following), terminated)
            total += float(reward)
            observation = following
            if len(self.replay) >= max(c.warm_up, 1):
                self.update()
            if terminated or truncated:
                returns.append(total)
                total = 0.0
                observation, _ = env.reset()
                self._noise.reset()
            if (
                callback
                and (step % every == 0 or step == steps)
                and callback(Progress(step, steps, tuple(returns)))
            ):
                return

    @property
    def updates(self) -> int:
        """Updates made so far."""
        return self._networks.updates

    def update(self) -> None:
        """One update of the critic and the actor from one batch of the replay."""
        self._networks.update(self.replay.sample(self.config.batch, self._rng))

    def remember(self, seen: Seen) -> None:
        """Add transitions to the replay as if they had been seen in ``learn``."""
        low, high = self.policy.low, self.policy.high
        normalised = 2 * (np.asarray(seen.actions, float) - low) / (high - low) - 1
        factor = self.config.reward_scale * self.scaling.reward
        scaled = factor * np.asarray(seen.rewards, float)
        before, after = (
            self.scaling.seen(rows) for rows in (seen.observations, seen.next_observations)
        )
        self.replay.extend(before, normalised, scaled, after, seen.terminated)

    def networks(self) -> dict[str, NDArray[np.float32]]:
        """A copy of all networks, targets and optimiser moments by name, for ``restore``."""
        return {name: array.copy() for name, array in self._networks.arrays().items()}

    def restore(self, networks: dict[str, NDArray[np.float32]]) -> None:
        """Return to a copy from ``networks``; replay and random state stay as they are.

        Raises:
            ValueError: The copy is from an agent with other networks.
        """
        self._networks.restore(networks)

    def save(self, path: str | Path, replay: bool = True) -> None:
        """Write the whole agent to a safetensors file; learning on after ``load`` is the same.

        Args:
            path: File to write; it appears whole or not at all.
            replay: Include the transitions. Without them a loaded agent warms up again.
        """
        arrays = {**self._networks.arrays(), "low": self.policy.low, "high": self.policy.high}
        if self.policy.scaling:
            arrays |= self.scaling.arrays()
        if replay:
            arrays["replay"] = self.replay.stored()
        metadata = {
            "config": dataclasses.asdict(self.config),
            "observation_size": self.policy.observation_size,
            "position": self.replay.position,
            "updates": self.updates,
            "random": self._rng.bit_generator.state,
        }
        if self.policy.columns:
            metadata |= self.policy.columns.plain()
        write_arrays(path, FORMAT, arrays, metadata)

    @classmethod
    def load(cls, path: str | Path) -> DDPG:
        """Read an agent written by ``save``; nothing in the file is executed.

        Raises:
            FileNotFoundError: There is no such file.
            ValueError: The file is damaged or holds something else.
        """
        arrays, metadata = read_arrays(path, FORMAT)
        with content_of(path, "agent"):
            return cls._restored(arrays, metadata)

    @classmethod
    def _restored(cls, arrays: dict[str, Any], metadata: dict[str, Any]) -> DDPG:
        low, high = arrays.pop("low"), arrays.pop("high")
        rows = arrays.pop("replay", None)
        # Files of earlier versions hold settings that are gone.
        known = {field.name for field in dataclasses.fields(DDPGConfig)}
        settings = {name: value for name, value in metadata["config"].items() if name in known}
        config, n_o = DDPGConfig(**settings), metadata["observation_size"]
        check_sizes(config, n_o, len(low), arrays)
        scaling = Scaling.taken_from(arrays, n_o)
        if low.dtype != np.float32 or high.dtype != np.float32 or not np.all(low <= high):
            raise ValueError("the bounds of the action are no float32, or the wrong way round")
        observed = gymnasium.spaces.Box(-np.inf, np.inf, (n_o,))
        columns, bounded = StateColumns.taken_from(metadata), gymnasium.spaces.Box(low, high)
        agent = cls(observed, bounded, config, scaling=scaling, columns=columns)
        agent.restore(arrays)
        if rows is not None:
            agent.replay.restore(rows, whole("position", metadata["position"], 0, config.replay))
        agent._networks.updates = whole("updates", metadata["updates"], 0, 2**62)
        agent._rng.bit_generator.state = metadata["random"]
        return agent

    def _explore(self, observation: ArrayLike) -> NDArray[np.float64]:
        normalised = self.policy.normalised(observation)
        if normalised.ndim != 1:
            raise ValueError(
                "noise is for one observation at a time: it has a memory of one episode"
            )
        return np.minimum(np.maximum(normalised + self._noise(), -1.0), 1.0)
