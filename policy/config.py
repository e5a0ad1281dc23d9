"""The settings of DDPG."""

from __future__ import annotations

import dataclasses
import math

import numpy as np


@dataclasses.dataclass(frozen=True)
class DDPGConfig:
    """Settings of ``DDPG``; the defaults are the paper's, but for ``saturation_penalty``.

    Args:
        hidden: Widths of the two hidden layers of the actor and of the critic.
        action_layer: Hidden layer of the critic that the action enters, 1 or 2.
        actor_lr: Adam's step size for the actor.
        critic_lr: Adam's step size for the critic.
        critic_weight_decay: Factor of the critic's parameters added to their gradient.
        tau: Share of the way that the target networks move in each update.
        gamma: Discount per step.
        batch: Transitions per update.
        replay: Transitions remembered; the oldest are overwritten.
        noise_sigma: Exploration noise: standard deviation of its increment per step, in units
            of the action normalised to [-1, 1].
        noise_theta: Exploration noise: share forgotten per step.
        reward_scale: Factor on the rewards that the critic learns; returns are reported
            without it.
        saturation_penalty: Weight of the squared part of the actor's outputs before tanh that is
            beyond 2, where an action is 0.96 of its bound. An actor that has come to a bound in
            all states has no gradient left that would bring it back. 0 in the paper.
        warm_up: Transitions that must be in the replay before updates start; until then the
            current policy acts, with noise.

    Raises:
        ValueError: A value lies outside its range; the message says which.
    """

    hidden: tuple[int, int] = (400, 300)
    action_layer: int = 1
    actor_lr: float = 1e-4
    critic_lr: float = 1e-3
    critic_weight_decay: float = 0.0
    tau: float = 1e-3
    gamma: float = 0.99
    batch: int = 64
    replay: int = 300_000
    noise_sigma: float = 0.12
    noise_theta: float = 0.15
    reward_scale: float = 0.1
    saturation_penalty: float = 0.05
    warm_up: int = 1000

    def __repr__(self) -> str:
        # What is as by default tells nothing.
        values = ((f.name, getattr(self, f.name), f.default) for f in dataclasses.fields(self))
        changed = ", ".join(f"{name}={now!r}" for name, now, usual in values if now != usual)
        return f"{type(self).__name__}({changed})"

    def __post_init__(self) -> None:
        object.__setattr__(self, "hidden", tuple(self.hidden))
        if len(self.hidden) != 2:
            raise ValueError(f"ddpg.hidden is {self.hidden}, expected the widths of two layers")
        if not all(isinstance(width, int | np.integer) and width > 0 for width in self.hidden):
            raise ValueError(f"ddpg.hidden is {self.hidden}, expected whole numbers from 1")
        for name, low, high in (
            ("action_layer", 1, 2),
            ("tau", 0, 1),
            ("gamma", 0, 1),
            ("noise_theta", 0, 1),
            ("actor_lr", 0, math.inf),
            ("critic_lr", 0, math.inf),
            ("critic_weight_decay", 0, math.inf),
            ("noise_sigma", 0, math.inf),
            ("saturation_penalty", 0, math.inf),
            ("batch", 1, math.inf),
            ("warm_up", 0, math.inf),
            ("replay", self.batch, math.inf),
        ):
            value = getattr(self, name)
            if not low <= value <= high:
                raise ValueError(f"ddpg.{name} is {value}, expected a value from {low} to {high}")


def whole(name: str, value: object, low: int, high: int) -> int:
    """A whole number from a file.

    Raises:
        ValueError: It is none, or not from ``low`` to ``high``.
    """
    if type(value) is not int or not low <= value <= high:
        raise ValueError(f"{name} is {value!r:.40}, expected a whole number from {low} to {high}")
    return value
