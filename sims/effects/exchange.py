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
    from sims.simulator import Joint

#: Units of a concentration: volumes below the line, and moles by the litre.
VOLUMES = ("L", "l", "dL", "dl", "mL", "ml", "uL", "µL", "m^3", "m³", "cm^3", "dm^3")
MOLAR = ("M", "mM", "uM", "µM", "nM")


@dataclasses.dataclass(frozen=True)
class BetweenStates(Effect):
    """What two states do to the rate of change of each other.

    Attributes:
        joint: Names of both states, ``"first and second"``.
        between: What it may be between, in words.
    """

    joint: str

    enters: ClassVar = "joint"
    between: ClassVar[str] = "pair of states of one unit"

    @property
    def pair(self) -> tuple[str, ...]:
        """Names of the two states."""
        return tuple(self.joint.split(AND))

    @abc.abstractmethod
    def flows(self, positions: Both, rates: Both) -> Both:
        """Rates of change of both states, by row; the states count as rates."""

    @staticmethod
    def pairs(simulator: HostSimulator) -> list[tuple[str, str]]:
        """The pairs of states that it may be between."""
        return like_states(simulator)

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """Unit and typical size of the first state and its rate of change; ``other`` of both are
        the second's."""
        known = {AND.join(names): names for names in self.pairs(simulator)}
        names = place(self.between, self.joint, known)
        joints = {joint.name: joint for joint in simulator.joints}
        first, second = (joints[name] for name in names)
        channels = {channel.name: channel for channel in simulator.state_channels}
        own, other = channels[first.position], channels[second.position]
        return {
            "force": (first.unit, simulator.force_scale(first)),
            "position": (own.unit, own.scale),
            "other_force": (second.unit, simulator.force_scale(second)),
            "other": (other.unit, other.scale),
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
    return [(a.name, b.name) for a, b in _stored_pairs(simulator) if a.unit == b.unit]


def meeting_states(simulator: HostSimulator) -> list[tuple[str, str]]:
    """The same, and every two concentrations, whatever their units."""
    units = {channel.name: channel.unit for channel in simulator.state_channels}
    return [
        (a.name, b.name)
        for a, b in _stored_pairs(simulator)
        if a.unit == b.unit or (_dissolved(units[a.position]) and _dissolved(units[b.position]))
    ]


def _stored_pairs(simulator: HostSimulator) -> list[tuple[Joint, Joint]]:
    """Every two states of a first-order system that are of what is stored."""
    if not simulator.written_out:
        return []
    stored = {channel.name for channel in simulator.state_channels if is_stored(channel)}
    still = [j for j in simulator.joints if j.rate is None and j.position in stored]
    return list(itertools.combinations(still, 2))


def _dissolved(unit: str) -> bool:
    """Whether a unit is of a concentration: an amount by a volume, or molar."""
    amount, _, volume = unit.rpartition("/")
    return (bool(amount) and volume in VOLUMES) or unit in MOLAR
