"""A command that the actuator follows at a limited pace."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, Self

from sims.effects.actuator import ActuatorEffect
from sims.effects.base import number
from sims.effects.joint import Value

if TYPE_CHECKING:
    from sims.host import HostSimulator


@dataclasses.dataclass(frozen=True)
class SlewLimit(ActuatorEffect):
    """The actuator follows the command by at most ``full / time`` a second.

    Goals of servos, drives and valves run along a ramp; a small step is followed soon, a large one
    late. A delay or a lag comes near, each of the mean time, and both of one time for all steps.
    """

    time: Value = number(low=0.0, time=1, starts=(1.0, 5.0, 25.0))
    full: Value = number(1.0, role="fixed", starts=(1.0,), input=1)

    name: ClassVar[str] = "slew_limit"
    sentence: ClassVar[str] = "The actuator follows its command at a limited pace, along a ramp."
    needs: ClassVar[str] = "small and large sudden changes of the input"
    family: ClassVar[str] = "delay or lag"
    upstream_of_sensor: ClassVar[bool] = True
    stage: ClassVar[int] = 7

    @property
    def seconds_per_unit(self) -> Value:
        """How long a change by one unit takes."""
        return self.time / self.full

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """See ``ActuatorEffect.measures``."""
        if not simulator.written_out:
            raise ValueError(f"{self.name} needs a system that is written as equations")
        return super().measures(simulator)

    def suited_to(self, low: float, high: float) -> Self:
        """The same with ``full`` from the lowest to the highest of the commands."""
        return self.with_values(full=float(high - low)) if high > low else self
