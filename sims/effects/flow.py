"""A medium that moves: a current, a wind."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from sims.effects.base import Effect, number, place
from sims.effects.joint import Value

if TYPE_CHECKING:
    from sims.host import HostSimulator


@dataclasses.dataclass(frozen=True)
class AmbientFlow(Effect):
    """The medium moves: the equations feel the joint's rate less ``speed``.

    The drag of ships, aircraft and vehicles acts by their speed through water or air, which a
    current or a wind makes another one than that over the ground (Fossen, Handbook of Marine Craft
    Hydrodynamics and Motion Control, 2011, chapter 8). It concerns what the simulator itself makes
    of the rate, and no effect beside it.

    Hosted by ``EquationOfMotion``: of a speed alone a sensor's zero does the same.
    """

    joint: str
    speed: Value = number(share=0.2, rate=1)

    name: ClassVar[str] = "ambient_flow"
    sentence: ClassVar[str] = (
        "The medium moves, as a current or a wind: drag acts by the speed through it."
    )
    enters: ClassVar = "joint"
    needs: ClassVar[str] = "motion at several speeds, either way"
    pushes: ClassVar[bool] = True

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """Unit and typical size of the rate."""
        joint = place("joint", self.joint, {joint.name: joint for joint in simulator.joints})
        if not simulator.written_out or joint.rate in (None, joint.position):
            raise ValueError(
                f"{self.name} needs a joint of an EquationOfMotion; {self.joint!r} is none"
            )
        channels = {channel.name: channel for channel in simulator.state_channels}
        rate = channels[str(joint.rate)]
        return {"rate": (rate.unit, rate.scale)}
