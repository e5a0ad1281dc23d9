"""What the state of a first-order system loses by itself: a leak, a decay, a hole."""

from __future__ import annotations

import dataclasses
from typing import ClassVar, Self

import numpy as np

from sims.effects.base import number
from sims.effects.joint import JointEffect, Value


@dataclasses.dataclass(frozen=True)
class ProportionalLoss(JointEffect):
    """Loss of what is there, on the state x of a first-order system: ``-rate x``.

    A leak, an outflow, a decay, heat that goes to surroundings at zero. Together with a constant
    load it draws to any other value. On a speed it is ``ViscousFriction``.
    """

    rate: Value = number(low=0.0, force=1, position=-1)

    name: ClassVar[str] = "proportional_loss"
    sentence: ClassVar[str] = "A loss in proportion to what is there: a leak, a decay."
    needs: ClassVar[str] = "small and large values"
    mechanical: ClassVar[bool] = False
    if_it_moves: ClassVar[str] = "viscous_friction"

    def force(self, q: Value, v: Value) -> Value:
        """Rate of change by the loss; the state of a first-order system counts as a rate."""
        return -self.rate * v


@dataclasses.dataclass(frozen=True)
class PowerLoss(JointEffect):
    """Loss by a power of the state x of a first-order system: ``-level sign(x) |x / full|^power``.

    What runs through a hole goes by the root of the level or pressure above it (Torricelli), over
    a weir by its power of 3/2, and a loss by turbulence or by recombination by the square.

    Attributes:
        level: Loss at ``full``.
        full: A large value of the state, at which the loss is told.
    """

    level: Value = number(low=0.0, force=1)
    power: Value = number(0.5, role="shape", low=0.2, high=4.0, starts=(0.5, 2.0))
    full: Value = number(1.0, role="fixed", starts=(1.0,), position=1)

    name: ClassVar[str] = "power_loss"
    sentence: ClassVar[str] = "A loss by a power of what is there: through a hole, over a weir."
    needs: ClassVar[str] = "small and large values"
    special_cases: ClassVar[tuple[str, ...]] = ("proportional_loss", "constant_loss")
    mechanical: ClassVar[bool] = False
    if_it_moves: ClassVar[str] = "quadratic_drag"

    def force(self, q: Value, v: Value) -> Value:
        """Rate of change by the loss; the state of a first-order system counts as a rate."""
        return -self.level * np.sign(v) * np.abs(v / self.full) ** self.power

    def suited_to(self, low: float, high: float) -> Self:
        """The same, told at the largest of the readings."""
        full = float(max(abs(low), abs(high)))
        return self.with_values(full=full) if full > 0 else self
