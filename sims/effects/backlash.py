"""Backlash: play between an actuator and the joint it drives."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from sims.effects.base import Effect, number
from sims.effects.joint import JointEffect, Value

if TYPE_CHECKING:
    from sims.host import HostSimulator


@dataclasses.dataclass(frozen=True)
class Backlash(Effect):
    """Play of ``width`` in the drive train of a joint.

    The drive force F is transmitted only while the play is closed on the side that F pushes
    to. When F changes sign the motor lets go and runs across the play at its free speed
    relative to the joint, ``gap' = F / (-dF/dv)`` (for a DC motor u/K - v; its own inertia is
    neglected); meanwhile the joint feels neither torque nor back-EMF. The position in the
    play, within +-width/2, is a memory channel.

    A simulator can host it if it tells the drive force (``drive_force``).
    """

    joint: str
    width: Value = number(low=0.0, position=1, share=0.1, starts=(0.02, 0.1, 0.4))

    name: ClassVar[str] = "backlash"
    sentence: ClassVar[str] = "Play in the drive: nothing is moved until it has been crossed."
    enters: ClassVar = "actuator"
    needs: ClassVar[str] = "reversals of the input at several sizes"

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """Unit and typical size of the joint's position."""
        if not simulator.has_drive_force:
            raise ValueError(
                f"{simulator.name} cannot host backlash: it does not tell its drive_force"
            )
        if any(joint.name == self.joint and joint.first_order for joint in simulator.joints):
            raise ValueError(f"backlash needs a joint with a position; {self.joint!r} has none")
        if any(joint.name == self.joint and not joint.driven for joint in simulator.joints):
            raise ValueError(f"backlash needs a driven joint; nothing drives {self.joint!r}")
        return JointEffect.measures(_Somewhere(self.joint), simulator)


class _Somewhere(JointEffect):
    """A joint, for its units."""

    name: ClassVar[str] = "backlash"

    def force(self, q: Value, v: Value) -> Value:
        return 0.0 * q
