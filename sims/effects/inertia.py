"""Inertia that moves with one joint and with no other."""

from __future__ import annotations

import abc
import dataclasses
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np

from sims.effects.base import Effect, number, place
from sims.effects.dimensions import product
from sims.effects.joint import Value
from sims.effects.waves import Waves, slope_of, sum_of

if TYPE_CHECKING:
    from sims.host import HostSimulator

#: Units of inertia, by those of the force on a joint and of its rate.
UNITS = {("N m", "rad/s"): "kg m^2", ("N", "m/s"): "kg"}


@dataclasses.dataclass(frozen=True)
class InertiaEffect(Effect):
    """A force ``-I q'' - I' q'^2 / 2`` on one joint: kinetic energy ``I(q) q'^2 / 2`` beside what
    the system has."""

    joint: str

    enters: ClassVar = "joint"

    @abc.abstractmethod
    def inertia_at(self, q: Value) -> Value:
        """What the diagonal of the mass matrix is larger by at position ``q``, by row."""

    def slope_at(self, q: Value) -> Value:
        """How that changes with the position."""
        return 0.0 * q

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """Unit and typical size of the inertia: what the joint has while the others are free."""
        joint = place("joint", self.joint, {joint.name: joint for joint in simulator.joints})
        moved = simulator.moved_by(joint)
        own = 0.0 if moved is None else np.median(moved[:, simulator.joints.index(joint)])
        if not 0 < own < np.inf:
            raise ValueError(
                f"{self.name} needs a joint of an equation of motion, and {self.joint!r} is none"
            )
        channels = {channel.name: channel for channel in simulator.state_channels}
        units = joint.unit, channels[str(joint.rate)].unit
        known = {"force": (units[0], 1.0), "rate": (units[1], 1.0), "time": ("s", 1.0)}
        plain = product({"force": 1, "rate": -1, "time": 1}, known)
        return {"inertia": (UNITS.get(units, plain), float(1 / own))}


@dataclasses.dataclass(frozen=True)
class AddedInertia(InertiaEffect):
    """A force ``-inertia q''`` on the joint: the diagonal of the mass matrix is larger by it.

    A motor's rotor behind its gear, by the square of the ratio (the ``armature`` of MuJoCo; Spong
    and Vidyasagar, Robot Dynamics and Control, 1989, 6.1), or what a slide takes along. Alone a
    joint has its inertia in its equation; so it is hosted by those that move others, too.
    """

    inertia: Value = number(low=0.0, inertia=1)

    name: ClassVar[str] = "added_inertia"
    sentence: ClassVar[str] = "Inertia that moves with one joint alone, as a motor's rotor does."
    needs: ClassVar[str] = "motion in which joints move each other"

    def inertia_at(self, q: Value) -> Value:
        """The same everywhere."""
        return self.inertia

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """As for all of them; the joint has to move another one."""
        found = super().measures(simulator)
        if not moves_others(simulator, self.joint):
            raise ValueError(
                f"{self.name} needs a joint of an equation of motion that moves another one, and "
                f"{self.joint!r} is none"
            )
        return found


@dataclasses.dataclass(frozen=True)
class CrankInertia(InertiaEffect):
    """Inertia by the angle: a sum of ``sine_n sin(n q) + cosine_n cos(n q)`` beside what is there.

    A crank takes a slide of mass ``m`` along at ``r sin q`` times its own rate, so that the mean
    ``m r^2 / 2`` varies by as much twice a turn, and, by a rod of finite length, once and three
    times a turn by less (Den Hartog, Mechanical Vibrations, 1956, chapter 5). So do cams, universal
    joints and the linkages of presses. The mean is a matter of what there is.

    Attributes:
        per_radian: Radians in a unit of ``q``, set where it is hosted.
    """

    sine_1: Value = number(share=0.2, inertia=1)
    cosine_1: Value = number(share=0.2, inertia=1)
    sine_2: Value = number(share=0.2, inertia=1)
    cosine_2: Value = number(share=0.2, inertia=1)
    sine_3: Value = number(share=0.2, inertia=1)
    cosine_3: Value = number(share=0.2, inertia=1)
    per_radian: float = 1.0

    name: ClassVar[str] = "crank_inertia"
    sentence: ClassVar[str] = "Inertia that goes by the angle, as what a crank or a cam moves."
    needs: ClassVar[str] = "fast motion over a whole turn"
    turns: ClassVar[float] = 1.0
    compound: ClassVar[bool] = True

    def inertia_at(self, q: Value) -> Value:
        """What is beside the mean at an angle."""
        return sum_of(self._waves(), self.per_radian * q)

    def slope_at(self, q: Value) -> Value:
        """How that changes."""
        return self.per_radian * slope_of(self._waves(), self.per_radian * q)

    def _waves(self) -> Waves:
        return (
            (1, self.sine_1, self.cosine_1),
            (2, self.sine_2, self.cosine_2),
            (3, self.sine_3, self.cosine_3),
        )

    def where_turn_is(self, turn: float) -> Self:
        """The same of an angle that counts otherwise, in another unit."""
        return dataclasses.replace(self, per_radian=self.per_radian * (math.tau / turn))

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """As for all of them; the joint has to turn."""
        found = super().measures(simulator)
        positions = {joint.name: joint.position for joint in simulator.joints}
        channels = {channel.name: channel for channel in simulator.state_channels}
        if channels[positions[self.joint]].turn is None:
            raise ValueError(f"it needs a joint that turns; {self.joint!r} slides")
        return found


def moves_others(simulator: HostSimulator, name: str) -> bool:
    """Whether a joint is known to move others."""
    own = [joint.name for joint in simulator.joints].index(name)
    moved = simulator.moved_by(simulator.joints[own])
    return moved is not None and bool(0 < np.abs(np.delete(moved, own, axis=1)).sum() < np.inf)
