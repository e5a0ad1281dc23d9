"""Ends of a joint's way."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from sims.effects.base import number
from sims.effects.joint import JointEffect, Value

if TYPE_CHECKING:
    from sims.host import HostSimulator

#: Where a stop may be, as parts of the way that was measured, from the end on that side.
PLACES = (0.005, 0.03, 0.1)


@dataclasses.dataclass(frozen=True)
class Stop(JointEffect):
    """A stop that pushes back while it is touched: ``-(stiffness d + damping v)``, ``d`` deep.

    It never pulls (Hunt and Crossley, "Coefficient of restitution interpreted as damping in
    vibroimpact", Journal of Applied Mechanics 42, 1975, with a damping that does not depend on the
    depth). A hard stop is as stiff as samples and integration steps tell.
    """

    stiffness: Value = number(low=0.0, share=30.0, force=1, position=-1)
    damping: Value = number(low=0.0, force=1, rate=-1)
    at: Value = number(role="shape", position=1)

    needs: ClassVar[str] = "motion into the stop, again and again"
    compound: ClassVar[bool] = True
    side: ClassVar[float]

    def force(self, q: Value, v: Value) -> Value:
        """Force on the joint."""
        deep = self.side * (q - self.at)
        push = np.maximum(self.stiffness * deep + self.damping * self.side * v, 0.0)
        return -self.side * np.where(deep > 0, push, 0.0)

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """As for every joint effect; the joint needs a position."""
        found = super().measures(simulator)
        if "position" not in found:
            raise ValueError(f"{self.name} needs a joint with a position; {self.joint!r} is a rate")
        return found

    def places(self, low: float, high: float) -> tuple[float, ...]:
        """Where it is looked for on a way that was measured."""
        end, way = (high, high - low) if self.side > 0 else (low, low - high)
        return tuple(end - part * way for part in PLACES)


@dataclasses.dataclass(frozen=True)
class UpperStop(Stop):
    """At the upper end."""

    name: ClassVar[str] = "upper_stop"
    comes_with: ClassVar[str] = "lower_stop"
    sentence: ClassVar[str] = "A stop at the upper end of the way: a bumper, a cylinder's end."
    side: ClassVar[float] = 1.0


@dataclasses.dataclass(frozen=True)
class LowerStop(Stop):
    """At the lower end."""

    name: ClassVar[str] = "lower_stop"
    sentence: ClassVar[str] = "A stop at the lower end of the way: a bumper, a floor, a valve seat."
    side: ClassVar[float] = -1.0
