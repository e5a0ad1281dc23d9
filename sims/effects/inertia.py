"""Inertia that moves with one joint and with no other."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from sims.effects.base import Effect, number, place
from sims.effects.dimensions import product
from sims.effects.joint import Value

if TYPE_CHECKING:
    from sims.host import HostSimulator

#: Units of inertia, by that of the force on a joint.
UNITS = {"N m": "kg m^2", "N": "kg"}


@dataclasses.dataclass(frozen=True)
class AddedInertia(Effect):
    """A force ``-inertia q''`` on the joint: the diagonal of the mass matrix is larger by it.

    A motor's rotor behind its gear, by the square of the ratio (the ``armature`` of MuJoCo; Spong
    and Vidyasagar, Robot Dynamics and Control, 1989, 6.1), or what a slide takes along. Alone a
    joint has its inertia in its equation; so it is hosted by those that move others, too.
    """

    joint: str
    inertia: Value = number(low=0.0, inertia=1)

    name: ClassVar[str] = "added_inertia"
    sentence: ClassVar[str] = "Inertia that moves with one joint alone, as a motor's rotor does."
    enters: ClassVar = "joint"
    needs: ClassVar[str] = "motion in which joints move each other"

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """Unit and typical size of the inertia: what the joint has while the others are free."""
        joint = place("joint", self.joint, {joint.name: joint for joint in simulator.joints})
        own = simulator.coupled_inertia(joint)
        if own is None:
            raise ValueError(
                f"{self.name} needs a joint of an equation of motion that moves another one, and "
                f"{self.joint!r} is none"
            )
        channels = {channel.name: channel for channel in simulator.state_channels}
        ratio = {"force": (joint.unit, 1.0), "rate": (channels[str(joint.rate)].unit, 1.0)}
        plain = product({"force": 1, "rate": -1, "time": 1}, {**ratio, "time": ("s", 1.0)})
        return {"inertia": (UNITS.get(joint.unit, plain), own)}
