"""What acts between two joints: with opposite forces on both, by how one lies or moves to the
other."""

from __future__ import annotations

import abc
import dataclasses
import itertools
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from sims.effects.actuator import AND
from sims.effects.base import Both, Effect, number, place
from sims.effects.joint import RESTS, Value

if TYPE_CHECKING:
    from sims.host import HostSimulator


@dataclasses.dataclass(frozen=True)
class Link(Effect):
    """A force ``F`` on one joint and ``-ratio F`` on another, by ``q1 - ratio q2`` or its rate.

    The two may be bodies that a spring joins, or joints that a tendon or a belt runs over: the
    ratio is that of its lever arms, and negative where it pulls both the same way. The work that
    is done at one joint is taken from the other, or lost.

    Attributes:
        joint: Names of both joints, ``"first and second"``.
        ratio: How far the first moves for the second where the link keeps its length.
    """

    joint: str
    ratio: Value = number(1.0, role="shape", low=-8.0, high=8.0, starts=(1.0, -1.0))

    enters: ClassVar = "joint"
    by_position: ClassVar[bool] = True

    @property
    def pair(self) -> tuple[str, ...]:
        """Names of the two joints."""
        return tuple(self.joint.split(AND))

    @abc.abstractmethod
    def pull(self, away: Value, parting: Value) -> Value:
        """Force on the first joint, by ``q1 - ratio q2`` and its rate of change, by row."""

    def flows(self, positions: Both, rates: Both) -> Both:
        """Forces on both joints, by row."""
        away, parting = (first - self.ratio * other for first, other in (positions, rates))
        force = self.pull(away, parting)
        return force, -self.ratio * force

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """Unit and typical size of force, position and rate at the first joint."""
        known = {AND.join(names): names for names in linked_joints(simulator)}
        first, _ = place("pair of joints of one unit", self.joint, known)
        joint = next(joint for joint in simulator.joints if joint.name == first)
        channels = {channel.name: channel for channel in simulator.state_channels}
        if self.by_position and joint.position == joint.rate:
            raise ValueError(f"{self.name} needs joints with positions; {first!r} is a rate")
        kinds = {"position": joint.position, "rate": str(joint.rate)}
        found = {kind: (channels[name].unit, channels[name].scale) for kind, name in kinds.items()}
        return {"force": (joint.unit, simulator.force_scale(joint)), **found}


@dataclasses.dataclass(frozen=True)
class CouplingSpring(Link):
    """A spring between two joints: ``-stiffness (q1 - ratio q2 - rest)``; angles do not wrap."""

    stiffness: Value = number(low=0.0, force=1, position=-1)
    rest: Value = number(role="shape", position=1, starts=RESTS)

    name: ClassVar[str] = "coupling_spring"
    sentence: ClassVar[str] = "A spring between two joints: a tendon, a belt, a rubber band."
    needs: ClassVar[str] = "times at which the two move against each other"
    family: ClassVar[str] = "spring"

    def pull(self, away: Value, parting: Value) -> Value:
        """Force that draws the two together."""
        return -self.stiffness * (away - self.rest)


@dataclasses.dataclass(frozen=True)
class CouplingDamper(Link):
    """A damper between two joints: ``-coefficient (v1 - ratio v2)``."""

    coefficient: Value = number(low=0.0, force=1, rate=-1)

    name: ClassVar[str] = "coupling_damper"
    sentence: ClassVar[str] = "A damper between two joints: a shock absorber, oil in a coupling."
    needs: ClassVar[str] = "times at which the two move against each other"
    family: ClassVar[str] = "dissipation"
    by_position: ClassVar[bool] = False

    def pull(self, away: Value, parting: Value) -> Value:
        """Force that keeps the two from parting."""
        return -self.coefficient * parting


@dataclasses.dataclass(frozen=True)
class AsymmetricCouplingDamping(Link):
    """A damper between two joints that is harder one way, and as much softer the other:
    ``-forward |v1 - ratio v2|``, beside what the simulator has.

    The shock absorber of a car is several times as hard in rebound as in compression, and pulls the
    body down in the mean while the wheel runs over a rough road ("jacking down"; Dixon, "The Shock
    Absorber Handbook", 2007). Hosted by written-out equations.
    """

    forward: Value = number(force=1, rate=-1)

    name: ClassVar[str] = "asymmetric_coupling_damping"
    sentence: ClassVar[str] = (
        "A damper between two joints that is harder one way: the shock absorber of a car."
    )
    needs: ClassVar[str] = "times at which the two move against each other, slowly and fast"
    pushes: ClassVar[bool] = True
    family: ClassVar[str] = "dissipation"
    by_position: ClassVar[bool] = False

    def pull(self, away: Value, parting: Value) -> Value:
        """Force beside that of a damper which is as hard either way."""
        return -self.forward * np.abs(parting)

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """As for every link; the system has to be written out."""
        if not simulator.written_out:
            raise ValueError(f"{self.name} needs a system that is written out as equations")
        return super().measures(simulator)


@dataclasses.dataclass(frozen=True)
class CouplingUnbalance(Link):
    """A weight that two joints turn: ``sine sin(q1 - ratio q2) + cosine cos(q1 - ratio q2)``.

    The forearm of an arm that was to move in a plane, on a base that tilts: gravity pulls at both
    joints by the sum of their angles, which is a ratio of -1. It goes by angles in rad, and is
    hosted by written-out equations.
    """

    ratio: Value = number(-1.0, role="shape", low=-8.0, high=8.0, starts=(-1.0, 1.0))
    sine: Value = number(force=1, share=0.1)
    cosine: Value = number(force=1, share=0.1)

    name: ClassVar[str] = "coupling_unbalance"
    sentence: ClassVar[str] = "A weight that two joints turn: a forearm on a base that tilts."
    needs: ClassVar[str] = "a quarter of a turn or more, of the two together"

    def pull(self, away: Value, parting: Value) -> Value:
        """Torque that gravity makes."""
        return self.sine * np.sin(away) + self.cosine * np.cos(away)

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """As for every link; the joints have to turn, in rad, and the system to be written out."""
        found = super().measures(simulator)
        if not simulator.written_out or found["position"][0] != "rad":
            raise ValueError(f"{self.name} needs a system of written-out equations, in rad")
        return found


def linked_joints(simulator: HostSimulator) -> list[tuple[str, str]]:
    """Every two neighbours among the joints whose positions, rates and forces have one unit."""
    if not simulator.hosts_links:
        return []
    units = {channel.name: channel.unit for channel in simulator.state_channels}
    return [
        (a.name, b.name)
        for a, b in itertools.pairwise(simulator.joints)
        if None not in (a.rate, b.rate)
        and (units[a.position], units[str(a.rate)], a.unit)
        == (units[b.position], units[str(b.rate)], b.unit)
    ]
