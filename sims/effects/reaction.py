"""What two states of a first-order system make of each other where they meet."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from sims.effects.actuator import AND
from sims.effects.base import Both, Effect, number, place
from sims.effects.exchange import like_states
from sims.effects.joint import Value

if TYPE_CHECKING:
    from sims.host import HostSimulator


@dataclasses.dataclass(frozen=True)
class Reaction(Effect):
    """Two states meet: ``x1' -= from_first x1 x2`` and ``x2' -= from_second x1 x2``.

    A reaction of second order by the law of mass action (Guldberg and Waage, 1864), prey that is
    eaten and what grows by it (Lotka, 1925), an infection. A strength below zero adds to a state.

    Attributes:
        joint: Names of both states, ``"first and second"``.
    """

    joint: str
    from_first: Value = number(force=1, position=-2)
    from_second: Value = number(force=1, position=-2)

    name: ClassVar[str] = "reaction"
    sentence: ClassVar[str] = "Two states use each other up where they meet: a reaction, a hunt."
    enters: ClassVar = "joint"
    needs: ClassVar[str] = "much and little of each, with much and with little of the other"

    @property
    def pair(self) -> tuple[str, ...]:
        """Names of the two states."""
        return tuple(self.joint.split(AND))

    def flows(self, positions: Both, rates: Both) -> Both:
        """Rates of change of both states, by row."""
        meet = rates[0] * rates[1]
        return -self.from_first * meet, -self.from_second * meet

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """Unit and typical size of the first state and its rate of change."""
        known = {AND.join(names): names for names in like_states(simulator)}
        first, _ = place("pair of states of one unit", self.joint, known)
        joint = next(joint for joint in simulator.joints if joint.name == first)
        channel = next(c for c in simulator.state_channels if c.name == joint.position)
        return {
            "force": (joint.unit, simulator.force_scale(joint)),
            "position": (channel.unit, channel.scale),
        }
