"""DDPG's four networks with their optimisers, and one update of them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from policy.adam import Adam
from policy.config import DDPGConfig, whole
from policy.networks import Actor, Critic, FlatNetwork, Inputs
from policy.passes import Weights
from policy.replay import Batch

Array = NDArray[np.float32]
# What a file may claim, in bytes: a replay of 10^7 transitions of 100 observations is half of it.
_MOST = 2**34


class ActorCritic:
    """An actor and a critic, a slowly following copy of each, and Adam's moments.

    Args:
        observation_size: n_o.
        action_size: n_a.
        config: Settings.
        rng: Source of the initial weights.

    Attributes:
        updates: Updates made so far.
    """

    def __init__(
        self, observation_size: int, action_size: int, config: DDPGConfig, rng: np.random.Generator
    ) -> None:
        self.config = c = config
        sizes = (observation_size, action_size, c.hidden, c.batch, rng)
        self.actor, self.actor_target = Actor(*sizes), Actor(*sizes)
        self.critic, self.critic_target = (Critic(*sizes, c.action_layer) for _ in range(2))
        self.actor_target.parameters[:] = self.actor.parameters
        self.critic_target.parameters[:] = self.critic.parameters
        self._actor_adam = _adam(self.actor, self.actor_target, c.actor_lr)
        self._critic_adam = _adam(
            self.critic, self.critic_target, c.critic_lr, c.critic_weight_decay
        )
        self._now, self._following = (
            Inputs(observation_size, action_size, c.batch) for _ in range(2)
        )
        # Gradients of the batch's mean squared error and of minus its mean value, per column.
        self._mean_square = np.float32(2 / c.batch)
        self._mean_value = np.full((1, c.batch), -1 / c.batch, np.float32)
        self._gamma = np.float32(c.gamma)
        self.updates = 0

    def update(self, batch: Batch) -> None:
        """One update of the critic and the actor.

        Both gradients are those of the networks as they are before the update; Algorithm 1 of
        Lillicrap et al. (2016) takes the actor's one critic step of size ``critic_lr`` later.
        """
        c, now = self.config, self._now
        goal = self._goal(batch)
        self.updates += 1
        now.observations[:] = batch.observations.T
        now.actions[:] = batch.actions.T
        error = self.critic.forward(now) - goal
        self.critic.backward(now, error * self._mean_square)
        self.actor.forward(now)
        self.critic.forward(now)
        ascent = self.critic.d_actions(self._mean_value)
        self._critic_adam.step(c.tau)
        self.actor.backward(now, ascent, c.saturation_penalty)
        self._actor_adam.step(c.tau)

    def _goal(self, batch: Batch) -> Array:
        """What the critic should say of the batch, shape (1, batch)."""
        following = self._following
        following.observations[:] = batch.next_observations.T
        self.actor_target.forward(following)
        value = self.critic_target.forward(following)
        return batch.rewards.T + self._gamma * batch.alive.T * value

    def arrays(self) -> dict[str, Array]:
        """All networks, targets and moments by name, not copied."""
        arrays = {}
        for name, network, target, adam in (
            ("actor", self.actor, self.actor_target, self._actor_adam),
            ("critic1", self.critic, self.critic_target, self._critic_adam),
        ):
            arrays[name] = network.parameters
            arrays[f"{name}.target"] = target.parameters
            arrays |= {f"{name}.adam.{key}": value for key, value in adam.state().items()}
        return arrays

    def restore(self, arrays: dict[str, Array]) -> None:
        """Take over a copy of ``arrays``.

        Raises:
            ValueError: It is from other networks.
        """
        own = self.arrays()
        shapes = {name: array.shape for name, array in own.items()}
        given = {name: array.shape for name, array in arrays.items()}
        if shapes != given:
            raise ValueError(
                f"the networks have arrays {given}, expected {shapes}: "
                "the spaces and the config must be those they were learnt with"
            )
        for name, array in own.items():
            array[...] = arrays[name]


def _adam(
    network: FlatNetwork, target: FlatNetwork, learning_rate: float, weight_decay: float = 0.0
) -> Adam:
    flat = network.parameters, network.gradient, target.parameters
    return Adam(*flat, learning_rate, weight_decay)


def check_sizes(
    config: DDPGConfig, observation_size: int, action_size: int, arrays: Mapping[str, Array]
) -> None:
    """Whether arrays of a file are of an agent of these settings, before any memory is claimed.

    Raises:
        ValueError: A size is no whole number, or asks for more than the arrays hold.
    """
    n_o = whole("observation_size", observation_size, 1, arrays["actor"].size)
    hidden = tuple(whole("hidden", width, 1, arrays["actor"].size) for width in config.hidden)
    first, second = hidden
    late = action_size if config.action_layer == 2 else 0
    early = action_size - late
    wanted = {
        "actor": Weights.size(n_o + 1, (first, second), action_size, 0),
        "critic1": Weights.size(n_o + 1 + early, (first, second), 1, late),
    }
    for name, size in wanted.items():
        if arrays[name].shape != (size,) or arrays[name].dtype != np.float32:
            raise ValueError(
                f"{name} is {arrays[name].dtype} of shape {arrays[name].shape}, expected float32 "
                f"of shape ({size},) by the settings"
            )
    for name, width in (("batch", first + second + n_o), ("replay", 2 * n_o + action_size + 2)):
        whole(name, getattr(config, name), 1, _MOST // (4 * (width + action_size)))
