"""Generalized forces that depend smoothly on the position and rate of one joint."""

from __future__ import annotations

import abc
import dataclasses
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from sims.effects.base import Effect, number, place

if TYPE_CHECKING:
    from sims.host import HostSimulator

Value = Any  # float, or an array with one entry per row

# Where a spring may rest, as shares of the position's scale; the middle one is usual.
RESTS = (-0.5, 0.0, 0.5)


@dataclasses.dataclass(frozen=True)
class JointEffect(Effect):
    """A generalized force on one joint, applied inside every sub-step.

    Attributes:
        mechanical: False if the law makes sense without a rate, so that a first-order
            system can host it as a constant rate of change.
        follows_rate: True if the force depends on the rate.
        if_it_moves: What it is on a joint that moves, which hosts that in its place; empty if this.
    """

    joint: str

    enters: ClassVar = "joint"
    mechanical: ClassVar[bool] = True
    follows_rate: ClassVar[bool] = True
    if_it_moves: ClassVar[str] = ""

    def parts(self) -> tuple[JointEffect, ...]:
        """The simpler effects that it is the sum of, or itself alone."""
        return (self,)

    @abc.abstractmethod
    def force(self, q: Value, v: Value) -> Value:
        """Force on the joint, in its unit, at position ``q`` and rate ``v``, by row."""

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """Unit and typical size of force, position and rate at the joint."""
        joint = place("joint", self.joint, {joint.name: joint for joint in simulator.joints})
        if joint.rate is None and self.mechanical:
            raise ValueError(
                f"{self.name} needs a joint with a rate; {joint.name!r} is the state of a "
                "first-order system, which hosts constant_load, proportional_loss and exchange; "
                'a speed is a channel of kind="rate"'
            )
        if joint.rate is not None and self.if_it_moves:
            raise ValueError(
                f"{self.name} needs the state of a first-order system, and {self.joint!r} moves: "
                f"there it is {self.if_it_moves}"
            )
        speed = joint.position == joint.rate
        if speed and self.mechanical and not self.follows_rate:
            raise ValueError(f"{self.name} needs a joint with a position; {joint.name!r} is a rate")
        channels = {channel.name: channel for channel in simulator.state_channels}
        found = {"force": (joint.unit, simulator.force_scale(joint))}
        for kind, name in (("position", joint.position), ("rate", joint.rate)):
            if name is not None and not (speed and kind == "position"):
                found[kind] = (channels[name].unit, channels[name].scale)
        return found


@dataclasses.dataclass(frozen=True)
class ViscousFriction(JointEffect):
    """Friction that grows in proportion to the rate: ``-coefficient v``."""

    coefficient: Value = number(low=0.0, force=1, rate=-1)

    name: ClassVar[str] = "viscous_friction"
    sentence: ClassVar[str] = "Friction that grows in proportion to speed."
    needs: ClassVar[str] = "motion at several speeds"
    family: ClassVar[str] = "dissipation"

    def force(self, q: Value, v: Value) -> Value:
        """Force opposing the rate."""
        return -self.coefficient * v


@dataclasses.dataclass(frozen=True)
class AsymmetricDamping(JointEffect):
    """Viscous friction that is larger one way, and as much smaller the other: ``-forward |v|``.

    A shock absorber is several times as hard in rebound as in compression, see Dixon, "The Shock
    Absorber Handbook", 2007.
    """

    forward: Value = number(force=1, rate=-1)

    name: ClassVar[str] = "asymmetric_damping"
    sentence: ClassVar[str] = "Damping that is harder one way than the other: a shock absorber."
    pushes: ClassVar[bool] = True
    needs: ClassVar[str] = "motion at several speeds in both directions"
    family: ClassVar[str] = "dissipation"

    def force(self, q: Value, v: Value) -> Value:
        """Force by the size of the rate."""
        return -self.forward * abs(v)


@dataclasses.dataclass(frozen=True)
class QuadraticDrag(JointEffect):
    """Drag of a body in a fluid: ``-coefficient v |v|``."""

    coefficient: Value = number(low=0.0, force=1, rate=-2)

    name: ClassVar[str] = "quadratic_drag"
    sentence: ClassVar[str] = "Drag that grows with the square of speed, as in air or water."
    needs: ClassVar[str] = "fast motion and slow motion"
    family: ClassVar[str] = "dissipation"

    def force(self, q: Value, v: Value) -> Value:
        """Force opposing the rate."""
        return -self.coefficient * v * abs(v)


@dataclasses.dataclass(frozen=True)
class LinearSpring(JointEffect):
    """A spring: ``-stiffness (q - rest)``; an angle is not wrapped."""

    stiffness: Value = number(low=0.0, force=1, position=-1)
    rest: Value = number(role="shape", position=1, starts=RESTS)

    name: ClassVar[str] = "linear_spring"
    sentence: ClassVar[str] = "A spring that pulls back in proportion to the distance."
    needs: ClassVar[str] = "a wide range of positions"
    family: ClassVar[str] = "spring"
    follows_rate: ClassVar[bool] = False

    def force(self, q: Value, v: Value) -> Value:
        """Force towards the rest position."""
        return -self.stiffness * (q - self.rest)


@dataclasses.dataclass(frozen=True)
class CubicSpring(JointEffect):
    """A spring that stiffens: ``-stiffness (q - rest)^3``; an angle is not wrapped."""

    stiffness: Value = number(low=0.0, force=1, position=-3)
    rest: Value = number(role="shape", position=1, starts=RESTS)

    name: ClassVar[str] = "cubic_spring"
    sentence: ClassVar[str] = "A spring that is soft near its rest and stiffens far from it."
    needs: ClassVar[str] = "small and large displacements"
    family: ClassVar[str] = "spring"
    follows_rate: ClassVar[bool] = False

    def force(self, q: Value, v: Value) -> Value:
        """Force towards the rest position."""
        away = q - self.rest
        return -self.stiffness * (away * away * away)


@dataclasses.dataclass(frozen=True)
class NegativeStiffness(JointEffect):
    """What pushes away from where it is balanced: ``stiffness (q - rest)``.

    A magnet on iron, a weight above its pivot, a hull that the depth compresses.
    """

    stiffness: Value = number(low=0.0, force=1, position=-1)
    rest: Value = number(role="shape", position=1, starts=RESTS)

    name: ClassVar[str] = "negative_stiffness"
    sentence: ClassVar[str] = "A force that grows the farther away it pushes: a magnet on iron."
    needs: ClassVar[str] = "a wide range of positions"
    family: ClassVar[str] = "spring"
    follows_rate: ClassVar[bool] = False

    def force(self, q: Value, v: Value) -> Value:
        """Force away from where it is balanced."""
        return self.stiffness * (q - self.rest)


@dataclasses.dataclass(frozen=True)
class ConstantLoad(JointEffect):
    """A force that never changes; on a first-order system, a constant rate of change."""

    load: Value = number(force=1)

    name: ClassVar[str] = "constant_load"
    sentence: ClassVar[str] = "A force that pulls with constant strength in one direction."
    needs: ClassVar[str] = "motion in both directions"
    family: ClassVar[str] = "constant push"
    creeps: ClassVar[bool] = True
    mechanical: ClassVar[bool] = False
    follows_rate: ClassVar[bool] = False

    def force(self, q: Value, v: Value) -> Value:
        """The load, whatever the state."""
        return self.load + 0.0 * q


@dataclasses.dataclass(frozen=True)
class Cogging(JointEffect):
    """Torque of a motor's magnets: ``sine sin(order q) + cosine cos(order q)``."""

    sine: Value = number(force=1, share=0.1)
    cosine: Value = number(force=1, share=0.1)
    order: Value = number(
        6.0, role="shape", low=1.0, starts=tuple(range(2, 13)), integer=True, turn=1
    )

    name: ClassVar[str] = "cogging"
    sentence: ClassVar[str] = "A torque that repeats a whole number of times per turn."
    needs: ClassVar[str] = "slow motion over a good part of a turn"
    compound: ClassVar[bool] = True
    follows_rate: ClassVar[bool] = False

    def force(self, q: Value, v: Value) -> Value:
        """Torque at angle ``q``."""
        return self.sine * np.sin(self.order * q) + self.cosine * np.cos(self.order * q)

    def where_turn_is(self, turn: float) -> Self:
        """The same of an angle that counts otherwise, so that the order is no whole number."""
        return dataclasses.replace(self, order=self.order * (math.tau / turn))

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """As for every joint effect; the joint has to turn."""
        found = {**super().measures(simulator), "turn": ("1", 1.0)}
        joint = next(joint for joint in simulator.joints if joint.name == self.joint)
        channels = {channel.name: channel for channel in simulator.state_channels}
        position = channels[joint.position]
        if position.turn is None:
            raise ValueError(f"it needs a joint that turns; {self.joint!r} slides")
        return found


@dataclasses.dataclass(frozen=True)
class Unbalance(JointEffect):
    """Torque of a weight off the axis, which gravity pulls down: ``sine sin(q) + cosine cos(q)``.

    It is ``sqrt(sine^2 + cosine^2)`` at most, and hangs at rest at ``atan2(cosine, -sine)``.
    """

    sine: Value = number(force=1, share=0.1)
    cosine: Value = number(force=1, share=0.1)

    name: ClassVar[str] = "unbalance"
    sentence: ClassVar[str] = "A weight off the axis of what turns, which gravity pulls down."
    needs: ClassVar[str] = "a quarter of a turn or more"
    turns: ClassVar[float] = 0.25
    compound: ClassVar[bool] = True
    follows_rate: ClassVar[bool] = False

    def parts(self) -> tuple[JointEffect, ...]:
        """A torque that repeats once per turn."""
        return (Cogging(self.joint, self.sine, self.cosine, 1.0),)

    def force(self, q: Value, v: Value) -> Value:
        """Torque at angle ``q`` in rad."""
        return self.parts()[0].force(q, v)

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """As for cogging."""
        found = Cogging(self.joint).measures(simulator)
        return {kind: measure for kind, measure in found.items() if kind != "turn"}
