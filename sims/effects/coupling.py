"""What one state does to the rate of change of another."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from sims.effects.base import Both, Effect, number, place
from sims.effects.joint import Value

if TYPE_CHECKING:
    from sims.host import HostSimulator

#: Between what is acted on and what acts, in the name of a place.
BY = " by "


@dataclasses.dataclass(frozen=True)
class Coupling(Effect):
    """A force on one joint in proportion to the rate of another: ``strength v2`` on the first.

    In a first-order system the state counts as the rate: ``x1' += strength x2``. The back EMF of a
    motor, which lowers its current by its speed; the torque of a gyroscope, by the rate about the
    other axis; a rudder that rolls a ship.

    Attributes:
        joint: Names of what is acted on and of what acts, ``"first by second"``.
    """

    joint: str
    strength: Value = number(force=1, rate=-1)

    name: ClassVar[str] = "coupling"
    sentence: ClassVar[str] = "A state acts on another in proportion: back EMF, a gyroscope."
    enters: ClassVar = "joint"
    needs: ClassVar[str] = "times at which the other one moves by itself"

    @property
    def pair(self) -> tuple[str, ...]:
        """Names of what is acted on and of what acts."""
        return tuple(self.joint.split(BY))

    def flows(self, positions: Both, rates: Both) -> Both:
        """Forces on both joints, by row, from their rates."""
        return self.strength * rates[1], 0.0 * rates[1]

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """Unit and typical size of the force on the first and of the rate of the second."""
        known = {BY.join(names): names for names in coupled_states(simulator)}
        first, second = place("pair of joints", self.joint, known)
        joints = {joint.name: joint for joint in simulator.joints}
        acts = joints[second].rate or joints[second].position
        channel = next(c for c in simulator.state_channels if c.name == acts)
        return {
            "force": (joints[first].unit, simulator.force_scale(joints[first])),
            "rate": (channel.unit, channel.scale),
        }


def coupled_states(simulator: HostSimulator) -> list[tuple[str, str]]:
    """Every two joints of a written-out system of which the second may act on the first: not by an
    angle, nor by a coordinate that nothing depends on."""
    if not simulator.written_out:
        return []
    channels = {channel.name: channel for channel in simulator.state_channels}
    acting = {
        joint.name
        for joint in simulator.joints
        for own in [channels[joint.rate or joint.position]]
        if own.turn is None and not own.invariant
    }
    names = [joint.name for joint in simulator.joints]
    return [(a, b) for a, b in itertools.permutations(names, 2) if b in acting]
