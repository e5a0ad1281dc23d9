"""How a state goes on its way, whatever drives it."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from sims.effects.base import Effect, number, place
from sims.effects.inertia import moves_others
from sims.effects.joint import Value
from sims.effects.pull import pulled_by_position

if TYPE_CHECKING:
    from sims.host import HostSimulator
    from sims.simulator import Joint


@dataclasses.dataclass(frozen=True)
class AsymmetricResponse(Effect):
    """On its way back a state changes ``1 + back`` times as fast.

    A speed is on its way back while it slows down, anything else while it falls: a motor that
    coasts and is driven up, a propeller, a tank or a cylinder that empties by another opening than
    it fills, what is heated by force and cools by itself. Simulators of rotors have a time constant
    for either way (``timeConstantUp`` and ``timeConstantDown`` of Furrer, Burri, Achtelik and
    Siegwart, "RotorS - A modular Gazebo MAV simulator framework", 2016).

    Hosted by ``FirstOrderSystem``, and by ``EquationOfMotion`` for the speed of a joint that moves
    alike wherever it is, and moves no other one: a wheel of which the angle is read.
    """

    joint: str
    back: Value = number(low=-0.95, share=0.5, force=0)

    name: ClassVar[str] = "asymmetric_response"
    sentence: ClassVar[str] = "It falls, or slows down, at another pace than it rises."
    enters: ClassVar = "joint"
    needs: ClassVar[str] = "rises and falls of one size"

    def changed(self, state: Value, change: Value, speed: bool) -> Value:
        """The rate of change of a state, by row, from what it would be without it."""
        back = change * np.sign(state) < 0 if speed else change < 0
        return change * np.where(back, 1.0 + self.back, 1.0)

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """Unit and typical size of the rate of change."""
        joint = place("joint", self.joint, {joint.name: joint for joint in simulator.joints})
        if not (simulator.written_out and (joint.first_order or _is_a_wheel(simulator, joint))):
            raise ValueError(
                f"{self.name} needs a state of a FirstOrderSystem, or a joint that moves alike "
                f"wherever it is and moves no other one; {self.joint!r} is none"
            )
        return {"force": (joint.unit, simulator.force_scale(joint))}


def _is_a_wheel(simulator: HostSimulator, joint: Joint) -> bool:
    """Whether nothing pulls a joint by where it is, and it moves no other one."""
    return not moves_others(simulator, joint.name) and not pulled_by_position(simulator, joint.name)
