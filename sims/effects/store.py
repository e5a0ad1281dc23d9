"""What is stored beside the state of a first-order system, and takes part slowly."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from sims.effects.base import Both, Effect, number, place
from sims.effects.joint import Value
from sims.simulator import Channel

if TYPE_CHECKING:
    from sims.host import HostSimulator

#: Control periods that a store usually takes to follow.
SLOWLY = 10.0


@dataclasses.dataclass(frozen=True)
class SecondStore(Effect):
    """A store z that nobody measures: ``x' += rate (z - x)`` and ``z' = (x - z) / time``.

    A wall that warms with the air, the core of a body, a reservoir beside a tank. ``rate`` is the
    conductance over the capacity of x, ``time`` the capacity of z over the conductance. It is a
    memory channel, and at first in balance with x.
    """

    joint: str
    rate: Value = number(low=0.0, force=1, position=-1)
    time: Value = number(1.0, role="shape", low=1e-9, time=1, starts=(1.0, 5.0, 25.0, 125.0))

    name: ClassVar[str] = "second_store"
    sentence: ClassVar[str] = "Something beside it takes part slowly: a wall, a core, a reservoir."
    enters: ClassVar = "joint"
    needs: ClassVar[str] = "fast changes, and long rests after them"

    def flows(self, positions: Both, rates: Both) -> Both:
        """Rates of change of the state and of the store, by row."""
        first, second = rates
        lead = second - first
        return self.rate * lead, -lead / self.time

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """Unit and typical size of the state, of its rate of change, and of time."""
        joint = place("joint", self.joint, {joint.name: joint for joint in simulator.joints})
        channel = next(c for c in simulator.state_channels if c.name == joint.position)
        if not simulator.written_out or joint.rate is not None or not is_stored(channel):
            raise ValueError(
                f"{self.name} needs the state of a first-order system, and {self.joint!r} moves"
            )
        return {
            "force": (joint.unit, simulator.force_scale(joint)),
            "position": (channel.unit, channel.scale),
            "time": ("s", SLOWLY * simulator.dt),
        }


def is_stored(channel: Channel) -> bool:
    """Whether a state may be of something that is stored: no angle, no speed, and no coordinate
    that nothing depends on."""
    moves = channel.turn is not None or channel.unit == "rpm"
    return not (moves or channel.invariant or channel.unit.endswith("/s"))


def stores(simulator: HostSimulator) -> list[SecondStore]:
    """The stores of a simulator that are not at zero strength."""
    return [e for e in simulator.effects if isinstance(e, SecondStore) and not e.absent]
