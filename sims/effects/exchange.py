"""What two states of a first-order system do to each other, and what flows between them."""

from __future__ import annotations

import abc
import dataclasses
import itertools
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from sims.effects.actuator import AND
from sims.effects.base import Both, Effect, number, place
from sims.effects.joint import Value
from sims.effects.store import is_stored

if TYPE_CHECKING:
    from sims.host import HostSimulator


@dataclasses.dataclass(frozen=True)
class BetweenStates(Effect):
    """What two states of one unit do to the rate of change of each other.

    Attributes:
        joint: Names of both states, ``"first and second"``.
    """

    joint: str

    enters: ClassVar = "joint"

    @property
    def pair(self) -> tuple[str, ...]:
        """Names of the two states."""
        return tuple(self.joint.split(AND))

    @abc.abstractmethod
    def flows(self, positions: Both, rates: Both) -> Both:
        """Rates of change of both states, by row; the states count as rates."""

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


@dataclasses.dataclass(frozen=True)
class Exchange(BetweenStates):
    """Two states draw to each other: ``x1' += into_first (x2 - x1)`` and the same the other way.

    Heat that is conducted from one body to the other, water in a pipe between two tanks. Each rate
    is the conductance over the capacity of what takes it in, so that they differ if the bodies do.
    """

    into_first: Value = number(low=0.0, force=1, position=-1)
    into_second: Value = number(low=0.0, force=1, position=-1)

    name: ClassVar[str] = "exchange"
    sentence: ClassVar[str] = "Two states draw to each other: heat is conducted, water levels out."
    needs: ClassVar[str] = "times at which the two differ"

    def flows(self, positions: Both, rates: Both) -> Both:
        """Rates of change of both states, by row."""
        first, second = rates
        lead = second - first
        return self.into_first * lead, -self.into_second * lead


def like_states(simulator: HostSimulator) -> list[tuple[str, str]]:
    """Every two states of a first-order system that have one unit, and are of what is stored."""
    if not simulator.written_out:
        return []
    stored = {channel.name for channel in simulator.state_channels if is_stored(channel)}
    still = [j for j in simulator.joints if j.rate is None and j.position in stored]
    return [(a.name, b.name) for a, b in itertools.combinations(still, 2) if a.unit == b.unit]
