"""Effects between a command and what the actuator receives."""

from __future__ import annotations

import abc
import dataclasses
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from sims.effects.base import Effect, Quantity, number, place
from sims.effects.joint import Value
from sims.simulator import Array

if TYPE_CHECKING:
    from sims.host import HostSimulator


#: Between the names of inputs on which one effect acts alike.
AND = " and "


@dataclasses.dataclass(frozen=True)
class ActuatorEffect(Effect):
    """A change of one input on its way to the actuator.

    Whatever their order in a list, effects act in the order of the classes below: bias, dead zone
    and square, in units of the command, gains, saturation of what comes out, then delay, then lag.

    Attributes:
        actuator: The input, or several of one unit on which it acts alike, ``"left and right"``.
        stage: Rank in that order.
    """

    actuator: str

    enters: ClassVar = "actuator"
    stage: ClassVar[int]

    @property
    def actuators(self) -> tuple[str, ...]:
        """The inputs that it acts on."""
        return tuple(self.actuator.split(AND))

    def meets(self, other: ActuatorEffect) -> bool:
        """Whether the two act on one input."""
        return not set(self.actuators).isdisjoint(other.actuators)

    def covers(self, other: Effect) -> bool:
        """Also the same effect on some of its inputs."""
        part = isinstance(other, ActuatorEffect) and set(other.actuators) < set(self.actuators)
        return super().covers(other) or (part and other.name == self.name)

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """Unit and typical size of the input, and the control period."""
        inputs = {channel.name: channel for channel in simulator.action_channels}
        channels = [place("actuator", name, inputs) for name in self.actuators]
        units = dict.fromkeys(channel.unit for channel in channels)
        if len(units) > 1:
            raise ValueError(f"{self.actuator!r} are inputs of several units: {', '.join(units)}")
        return {"input": (channels[0].unit, channels[0].scale), "time": ("s", simulator.dt)}


class StaticActuatorEffect(ActuatorEffect):
    """An actuator effect without memory: output from present input."""

    @abc.abstractmethod
    def shape(self, u: Value) -> Value:
        """What the actuator receives for the command ``u``, by row."""

    def shows(self, u: Array) -> NDArray[np.bool_]:
        """Where it changes what comes in beyond what other effects of the actuator do, by row."""
        return np.ones(np.shape(u), bool)


@dataclasses.dataclass(frozen=True)
class ActuatorBias(StaticActuatorEffect):
    """The actuator receives ``u + bias``."""

    bias: Value = number(input=1, share=0.1)

    name: ClassVar[str] = "actuator_bias"
    sentence: ClassVar[str] = "The actuator adds a constant to every command."
    needs: ClassVar[str] = "motion in both directions"
    family: ClassVar[str] = "constant push"
    creeps: ClassVar[bool] = True
    stage: ClassVar[int] = 0

    def shape(self, u: Value) -> Value:
        """Shifted command."""
        return u + self.bias


@dataclasses.dataclass(frozen=True)
class DeadZone(StaticActuatorEffect):
    """Commands within ``+-width`` do nothing, and larger ones lose ``width``."""

    width: Value = number(low=0.0, input=1, share=0.1, starts=(0.007, 0.027, 0.1, 0.27))

    name: ClassVar[str] = "dead_zone"
    sentence: ClassVar[str] = "Small commands do nothing, larger ones lose the same amount."
    needs: ClassVar[str] = "small and large inputs"
    upstream_of_sensor: ClassVar[bool] = True
    holds_still: ClassVar[bool] = True
    stage: ClassVar[int] = 1

    def shape(self, u: Value) -> Value:
        """What is left of the command."""
        return u - np.clip(u, -self.width, self.width)


@dataclasses.dataclass(frozen=True)
class QuadraticActuator(StaticActuatorEffect):
    """A part of the output is square: ``(1 - square) u + square u |u| / full``, straight beyond.

    At ``+-full`` the output is the command. ``square`` is 1 for the thrust of a propeller by its
    speed, the heat of a resistor by its voltage or the pull of a magnet by its current, and in
    between for many throttles (PX4 calls it ``THR_MDL_FAC``).
    """

    square: Value = number(low=0.0, high=1.0, input=0)
    full: Value = number(1.0, role="fixed", starts=(1.0,), input=1)

    name: ClassVar[str] = "quadratic_actuator"
    sentence: ClassVar[str] = (
        "A part of the output grows with the square of the command, as thrust or heat does."
    )
    needs: ClassVar[str] = "small, middling and large inputs"
    whole: ClassVar[tuple[str, ...]] = ("square",)
    stage: ClassVar[int] = 2

    @property
    def surprising(self) -> bool:
        """Always: most actuators are made to answer in proportion."""
        return True

    def shape(self, u: Value) -> Value:
        """What comes out for the command."""
        size = np.abs(u)
        within = np.minimum(size, self.full)
        bent = within * (1.0 - self.square * (1.0 - within / self.full))
        return np.sign(u) * (bent + (1.0 + self.square) * (size - within))

    def suited_to(self, low: float, high: float) -> Self:
        """The same with ``full`` at the largest of the commands."""
        full = float(max(abs(low), abs(high)))
        return self.with_values(full=full) if full > 0 else self


@dataclasses.dataclass(frozen=True)
class ActuatorGain(StaticActuatorEffect):
    """The actuator receives ``(1 + gain) u``."""

    gain: Value = number(low=-0.99, share=1.0, input=0)

    name: ClassVar[str] = "actuator_gain"
    sentence: ClassVar[str] = "The actuator is stronger or weaker than commanded, by a share."
    needs: ClassVar[str] = "a varied input"
    stage: ClassVar[int] = 3
    drives: ClassVar[bool] = True

    def shape(self, u: Value) -> Value:
        """Scaled command."""
        return (1.0 + self.gain) * u

    @property
    def turns_round(self) -> bool:
        """Whether the input acts the other way."""
        return bool(np.any(self.gain < -1.0))

    def quantities(self, simulator: HostSimulator) -> dict[str, Quantity]:
        """See ``Effect.quantities``; an input of both signs may act the other way."""
        known = super().quantities(simulator)
        channels = [c for c in simulator.action_channels if c.name in self.actuators]
        if all(channel.low < 0 < channel.high for channel in channels):
            known["gain"] = dataclasses.replace(known["gain"], low=-math.inf)
        return known


@dataclasses.dataclass(frozen=True)
class AsymmetricActuator(StaticActuatorEffect):
    """The actuator receives ``(1 + backward) u`` of commands below zero, others as they are.

    A propeller that is made for one direction, a cylinder with a rod on one side, a car that is
    driven and braked by one pedal signal.
    """

    backward: Value = number(low=-0.99, share=0.5, input=0)

    name: ClassVar[str] = "asymmetric_actuator"
    sentence: ClassVar[str] = "Commands below zero act more, or less, than those above."
    needs: ClassVar[str] = "inputs of both signs, of one size"
    stage: ClassVar[int] = 3

    def shape(self, u: Value) -> Value:
        """What comes out for the command."""
        return np.where(u < 0, (1.0 + self.backward) * u, u)

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """See ``ActuatorEffect.measures``; the input has to take both signs."""
        found = super().measures(simulator)
        inputs = (c for c in simulator.action_channels if c.name in self.actuators)
        if not all(channel.low < 0 < channel.high for channel in inputs):
            raise ValueError(f"{self.name} needs an input of both signs; {self.actuator!r} is not")
        return found


@dataclasses.dataclass(frozen=True)
class Saturation(StaticActuatorEffect):
    """Commands are cut at ``+-level``; an infinite level is no saturation."""

    level: Value = number(
        math.inf, low=1e-6, nominal=math.inf, input=1, starts=(0.99, 0.97, 0.85, 0.65, 0.4)
    )

    name: ClassVar[str] = "saturation"
    sentence: ClassVar[str] = "Commands beyond a level have no further effect."
    needs: ClassVar[str] = "inputs beyond the level"
    upstream_of_sensor: ClassVar[bool] = True
    stage: ClassVar[int] = 4

    def shape(self, u: Value) -> Value:
        """The command, cut."""
        return np.clip(u, -self.level, self.level)

    def shows(self, u: Array) -> NDArray[np.bool_]:
        """Where what comes in goes beyond the level."""
        return np.abs(u) > self.level


@dataclasses.dataclass(frozen=True)
class Delay(ActuatorEffect):
    """The actuator receives the command of ``time`` seconds ago."""

    time: Value = number(low=0.0, time=1, share=0.1, starts=(0.02, 0.1, 0.4, 1.0, 1.6))

    name: ClassVar[str] = "delay"
    sentence: ClassVar[str] = (
        "Commands arrive late by a fixed time, or all sensors do, which looks the same."
    )
    needs: ClassVar[str] = "sudden changes of the input"
    looks_like: ClassVar[str] = "sensors that are late by as much"
    family: ClassVar[str] = "delay or lag"
    stage: ClassVar[int] = 5


@dataclasses.dataclass(frozen=True)
class ActuatorLag(ActuatorEffect):
    """The actuator follows the command as a first-order filter: ``T y' = u - y``."""

    time_constant: Value = number(low=0.0, time=1, share=0.1, starts=(0.04, 0.2, 0.8, 2.4))

    name: ClassVar[str] = "actuator_lag"
    sentence: ClassVar[str] = "The actuator follows its command gradually, not at once."
    needs: ClassVar[str] = "sudden changes of the input, then rest"
    looks_like: ClassVar[str] = "a filter of that time constant in the sensors"
    family: ClassVar[str] = "delay or lag"
    upstream_of_sensor: ClassVar[bool] = True
    stage: ClassVar[int] = 6
