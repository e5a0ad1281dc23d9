"""A command that the actuator follows only after it has moved by a play."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from sims.effects.actuator import ActuatorEffect
from sims.effects.base import number
from sims.effects.joint import Value

if TYPE_CHECKING:
    from sims.host import HostSimulator


@dataclasses.dataclass(frozen=True)
class Hysteresis(ActuatorEffect):
    """The actuator lies within half of ``width`` of the command, and moves no more than it must.

    The play operator (M. Brokate and J. Sprekels, "Hysteresis and Phase Transitions", Springer
    1996, section 2.1): after a reversal the command runs through the whole width before anything
    follows. So do stems of valves, worn linkages and, smoothly, stacks of piezo discs. At the
    beginning of a record it lies in the middle.
    """

    width: Value = number(low=0.0, input=1, share=0.1, starts=(0.02, 0.1, 0.4))

    name: ClassVar[str] = "hysteresis"
    sentence: ClassVar[str] = "After a reversal the command runs through a play before it acts."
    needs: ClassVar[str] = "reversals of the input at several sizes"
    upstream_of_sensor: ClassVar[bool] = True
    stage: ClassVar[int] = 8

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """See ``ActuatorEffect.measures``."""
        if not simulator.written_out:
            raise ValueError(f"{self.name} needs a system that is written as equations")
        return super().measures(simulator)
