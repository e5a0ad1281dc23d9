"""Encoders whose error comes back every turn."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from sims.effects.base import number
from sims.effects.joint import Value
from sims.effects.sensor import SensorEffect, position_and_rate
from sims.effects.waves import Waves, slope_of, sum_of
from sims.simulator import Array

if TYPE_CHECKING:
    from sims.host import HostSimulator

#: Newton steps in which the angle behind a reading is found to the last digit.
STEPS = 8


@dataclasses.dataclass(frozen=True)
class EncoderError(SensorEffect):
    """The sensor reads ``x`` and the sum of ``sine_n sin n x + cosine_n cos n x`` for n from 1 to
    3, and the rate that is derived from it so.

    A disc, or a magnet, that sits off its axis by a part ``e`` of its radius errs by ``e`` rad at
    most, once per turn; one that is tilted, or no circle, and a shaft behind a universal joint, err
    twice per turn, a motor's Hall sensors oftener (Ellin and Dolsak, "The design and application of
    rotary encoders", Sensor Review 28, 2008).
    """

    sine_1: Value = number(share=0.02, low=-0.4, high=0.4, angle=1)
    cosine_1: Value = number(share=0.02, low=-0.4, high=0.4, angle=1)
    sine_2: Value = number(share=0.02, low=-0.2, high=0.2, angle=1)
    cosine_2: Value = number(share=0.02, low=-0.2, high=0.2, angle=1)
    sine_3: Value = number(share=0.02, low=-0.1, high=0.1, angle=1)
    cosine_3: Value = number(share=0.02, low=-0.1, high=0.1, angle=1)

    name: ClassVar[str] = "encoder_error"
    sentence: ClassVar[str] = (
        "The angle that is read errs once, twice or thrice per turn: a disc off its axis."
    )
    needs: ClassVar[str] = "a whole turn"
    turns: ClassVar[float] = 1.0
    compound: ClassVar[bool] = True
    stage: ClassVar[int] = 0

    def read(self, x: Value) -> Value:
        """Reading of an angle in rad."""
        return x + sum_of(self._waves(), x)

    def undo(self, x: Value) -> Value:
        """The angle in rad behind a reading, by Newton's method."""
        angle = x
        for _ in range(STEPS):
            angle = angle - (self.read(angle) - x) / self._slope(angle)
        return angle

    def _slope(self, x: Value) -> Value:
        return 1.0 + slope_of(self._waves(), x)

    def _waves(self) -> Waves:
        return (
            (1, self.sine_1, self.cosine_1),
            (2, self.sine_2, self.cosine_2),
            (3, self.sine_3, self.cosine_3),
        )

    def read_by_it(self, simulator: HostSimulator) -> tuple[str, ...]:
        """The angle and its rate."""
        return position_and_rate(simulator, self.channel)

    def read_from(self, simulator: HostSimulator) -> tuple[str, ...]:
        """The angle."""
        return (self.channel,)

    def through(self, simulator: HostSimulator, states: Array, forward: bool) -> None:
        """See ``SensorEffect.through``: the rate is read too fast where the angle is ahead."""
        channels = {channel.name: i for i, channel in enumerate(simulator.physical_channels)}
        place, *rates = (channels[name] for name in self.read_by_it(simulator))
        radian = (simulator.physical_channels[place].turn or math.tau) / math.tau
        angle = states[:, place] / radian
        true = angle if forward else self.undo(angle)
        states[:, place] = radian * (self.read(angle) if forward else true)
        for rate in rates:
            states[:, rate] *= self._slope(true) if forward else 1 / self._slope(true)

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """As for every sensor effect; the channel has to be an angle."""
        found = super().measures(simulator)
        channel = next(c for c in simulator.physical_channels if c.name == self.channel)
        if channel.turn is None or channel.kind != "position":
            raise ValueError(f"it needs an angle; {self.channel!r} is none")
        return {**found, "angle": ("rad", 1.0)}
