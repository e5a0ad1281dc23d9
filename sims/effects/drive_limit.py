"""A drive that makes no more than so much: a motor's current, a servo's torque."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from sims.effects.base import Effect, number, place
from sims.effects.joint import Value

if TYPE_CHECKING:
    from sims.host import HostSimulator


@dataclasses.dataclass(frozen=True)
class DriveLimit(Effect):
    """The force of the drive stays within ``+-level``; an infinite level is no limit.

    Amplifiers limit a motor's current, and servos their torque, so that a large voltage or a far
    goal makes no more than a smaller one, until the speed has come. The force is the simulator's
    ``drive_force``; of a first-order system that does not tell it, all change beyond that at rest
    without input, less what parameters of the family ``dissipation`` make.

    Hosted by systems that are written out as equations, where an input is no force itself: of a
    force a saturation does the same.
    """

    joint: str
    level: Value = number(
        math.inf, low=1e-9, nominal=math.inf, force=1, starts=(4.0, 2.0, 1.0, 0.5, 0.25, 0.12)
    )

    name: ClassVar[str] = "drive_limit"
    sentence: ClassVar[str] = "The drive makes no more than so much: a motor's limited current."
    enters: ClassVar = "joint"
    needs: ClassVar[str] = "large and small changes of the input"

    def lacking(self, drive: Value) -> Value:
        """What it takes off the force of the drive."""
        return np.clip(drive, -self.level, self.level) - drive

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """Unit and typical size of a force on the joint."""
        joint = place("joint", self.joint, {joint.name: joint for joint in simulator.joints})
        known = simulator.has_drive_force or joint.first_order
        if not (simulator.written_out and known):
            raise ValueError(
                f"{self.name} needs a system that is written as equations and tells its "
                f"drive_force; {simulator.name} does not"
            )
        if all(channel.pushes for channel in simulator.action_channels):
            raise ValueError(
                f"{self.name} needs an input that is no force itself; use saturation for those"
            )
        return {"force": (joint.unit, simulator.force_scale(joint))}
