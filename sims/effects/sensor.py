"""Effects of a sensor: what is read differs from what is there."""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np

from sims.effects.base import Effect, number, place
from sims.effects.joint import Value
from sims.simulator import Array

if TYPE_CHECKING:
    from sims.host import HostSimulator


#: Ranges of the readings by which zero lies outside them where a scale about zero means nothing.
FAR = 5.0


@dataclasses.dataclass(frozen=True)
class SensorEffect(Effect):
    """A change of one state channel on its way to the log.

    Scales act before offsets, whatever their order in a list.

    Attributes:
        stage: Rank in that order.
    """

    channel: str

    enters: ClassVar = "sensor"
    stage: ClassVar[int]

    def read_by_it(self, simulator: HostSimulator) -> tuple[str, ...]:
        """Names of all channels whose readings come from this sensor."""
        return (self.channel,)

    @abc.abstractmethod
    def read(self, x: Value) -> Value:
        """What the sensor reads where ``x`` is true, by row."""

    @abc.abstractmethod
    def undo(self, x: Value) -> Value:
        """What is true where the sensor reads ``x``: the inverse of ``read``."""

    def read_from(self, simulator: HostSimulator) -> tuple[str, ...]:
        """Those of them without which nothing of it shows."""
        return self.read_by_it(simulator)

    def through(self, simulator: HostSimulator, states: Array, forward: bool) -> None:
        """Write what it reads into true states, (n, n_i), or backward what is true where it reads
        them."""
        names = [channel.name for channel in simulator.physical_channels]
        change = self.read if forward else self.undo
        for column in map(names.index, self.read_by_it(simulator)):
            states[:, column] = change(states[:, column])

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """Unit and typical size of the channel."""
        channels = {c.name: c for c in simulator.state_channels if c.kind != "memory"}
        channel = place("state channel", self.channel, channels)
        return {"channel": (channel.unit, channel.scale)}


@dataclasses.dataclass(frozen=True)
class SensorOffset(SensorEffect):
    """The sensor reads too much by a constant ``offset``."""

    offset: Value = number(share=0.1, channel=1)

    name: ClassVar[str] = "sensor_offset"
    sentence: ClassVar[str] = "The sensor's zero is wrong: it reads too much by a constant."
    needs: ClassVar[str] = "a force that depends on the true position, such as gravity"
    family: ClassVar[str] = "constant push"
    creeps: ClassVar[bool] = True
    stage: ClassVar[int] = 1

    def read(self, x: Value) -> Value:
        """Reading."""
        return x + self.offset

    def undo(self, x: Value) -> Value:
        """Truth."""
        return x - self.offset

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """As for every sensor effect; the motion has to depend on the channel."""
        if any(c.name == self.channel and c.invariant for c in simulator.state_channels):
            raise ValueError(f"the motion does not depend on {self.channel!r}: no offset shows")
        return super().measures(simulator)


@dataclasses.dataclass(frozen=True)
class ScaledSensor(SensorEffect):
    """The sensor reads ``1 + scale`` times what is there."""

    scale: Value = number(share=0.1, low=-0.99, channel=0)

    stage: ClassVar[int] = 0

    @property
    def surprising(self) -> bool:
        """True: sensors are calibrated, and what is missing elsewhere is likelier."""
        return True

    def read(self, x: Value) -> Value:
        """Reading."""
        return x + self.scale * x

    def undo(self, x: Value) -> Value:
        """Truth."""
        return x / (1.0 + self.scale)


@dataclasses.dataclass(frozen=True)
class SensorScale(ScaledSensor):
    """The sensor reads ``zero + (1 + scale) (x - zero)``; an angle is not wrapped."""

    zero: Value = number(role="fixed", channel=1)

    name: ClassVar[str] = "sensor_scale"
    sentence: ClassVar[str] = "The sensor's scale is wrong: it reads a fixed share too much."
    needs: ClassVar[str] = "a wide range of positions"

    def read(self, x: Value) -> Value:
        """Reading."""
        return x + self.scale * (x - self.zero)

    def undo(self, x: Value) -> Value:
        """Truth."""
        return self.zero + (x - self.zero) / (1.0 + self.scale)

    def suited_to(self, low: float, high: float) -> Self:
        """The same about the middle of readings that are far from zero.

        Between 290 and 310 K a scale about 0 K is next to nothing but an offset.
        """
        reach = FAR * (high - low)
        if low - reach <= 0.0 <= high + reach:
            return self
        return self.with_values(zero=float(0.5 * (low + high)))


@dataclasses.dataclass(frozen=True)
class EncoderScale(ScaledSensor):
    """The sensor of a position, from which its rate is derived, reads so much too much.

    Encoders with other counts per turn, drums of another radius, cameras at another distance.
    """

    name: ClassVar[str] = "encoder_scale"
    sentence: ClassVar[str] = (
        "An encoder's scale is wrong: the position and its rate read the same fixed share too much."
    )
    needs: ClassVar[str] = "a force that is not in proportion to the motion, such as gravity"

    def read_by_it(self, simulator: HostSimulator) -> tuple[str, ...]:
        """The position and its rate."""
        return position_and_rate(simulator, self.channel)

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """As for every sensor effect; the position needs a rate."""
        if len(self.read_by_it(simulator)) == 1:
            raise ValueError(f"no channel is the rate of {self.channel!r}: use sensor_scale")
        return super().measures(simulator)


def position_and_rate(simulator: HostSimulator, position: str) -> tuple[str, ...]:
    """Names of a position and of the rate that is derived from it, if there is one."""
    return (position, *(c.name for c in simulator.physical_channels if c.rate_of == position))


def through_sensors(simulator: HostSimulator, states: Array, forward: bool) -> Array:
    """What the sensors read of true states, (n, n_i), or backward what is true where they do."""
    effects = [e for e in simulator.effects if isinstance(e, SensorEffect) and not e.absent]
    if not effects:
        return states
    states = np.array(states, float)
    for effect in sorted(effects, key=lambda effect: effect.stage, reverse=not forward):
        effect.through(simulator, states, forward)
    return states
