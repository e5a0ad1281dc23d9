"""Limits of how fast a joint or a state moves, whatever is commanded."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from sims.effects.base import Effect, number, place
from sims.effects.joint import Value
from sims.simulator import TURNS

if TYPE_CHECKING:
    from sims.host import HostSimulator

TEMPERATURES = {"K", "mK", "degC", "degF"}


@dataclasses.dataclass(frozen=True)
class RateLimit(Effect):
    """The rate stays within ``+-level``; an infinite level is no limit.

    A servo that turns at a set speed at most, a drive with a ramp. On the state x of a first-order
    system x' is cut. Of a joint the acceleration is, so that its rate ends at the level within a
    sub-step; what pushes beyond is taken up by whatever holds the speed.

    Hosted by systems that are written out as equations.
    """

    joint: str
    level: Value = number(
        math.inf, low=1e-9, nominal=math.inf, rate=1, starts=(0.95, 0.85, 0.7, 0.5, 0.3)
    )

    name: ClassVar[str] = "rate_limit"
    sentence: ClassVar[str] = "It moves no faster than a limit, whatever is commanded."
    enters: ClassVar = "joint"
    needs: ClassVar[str] = "large and small changes of what is commanded"

    def cut(self, rate: Value, acceleration: Value, span: Value) -> Value:
        """The acceleration that brings the rate no farther than the level.

        Args:
            rate: Of the joint, by row.
            acceleration: What it would be.
            span: Time in s in which a rate beyond the level comes back to it.
        """
        return np.clip(acceleration, (-self.level - rate) / span, (self.level - rate) / span)

    def cut_change(self, change: Value) -> Value:
        """The rate of change of a first-order system's state, cut."""
        return np.clip(change, -self.level, self.level)

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """Unit and typical size of the rate."""
        joint = place("joint", self.joint, {joint.name: joint for joint in simulator.joints})
        if not simulator.written_out:
            raise ValueError(
                f"{simulator.name} cannot host {self.name}: it is no EquationOfMotion and no "
                "FirstOrderSystem"
            )
        if joint.first_order:
            return {"rate": (joint.unit, simulator.force_scale(joint))}
        channel = next(c for c in simulator.state_channels if c.name == joint.rate)
        return {"rate": (channel.unit, channel.scale)}


def follows_command(simulator: HostSimulator, joint: str) -> bool:
    """Whether an input is of the kind of what the joint's state tells, so that this follows it.

    So do the angle of a servo and its command. A force or a voltage sets nothing that is reached;
    a speed that is slow to follow is easily taken for one whose change is limited; and a room
    follows the temperature outside, at any rate.
    """
    where = next(j.position for j in simulator.joints if j.name == joint)
    kind = _kind(next(c.unit for c in simulator.state_channels if c.name == where))
    speed = kind == "rpm" or kind.endswith("/s")
    followed = not speed and kind not in TEMPERATURES
    return followed and any(_kind(channel.unit) == kind for channel in simulator.action_channels)


def goals(simulator: HostSimulator) -> list[str]:
    """Inputs that a joint's state follows, see ``follows_command``."""
    where = {j.position for j in simulator.joints if follows_command(simulator, j.name)}
    followed = {_kind(c.unit) for c in simulator.state_channels if c.name in where}
    return [c.name for c in simulator.action_channels if _kind(c.unit) in followed]


def _kind(unit: str) -> str:
    """A unit, or one for all that measure angles."""
    return "rad" if unit in TURNS else unit
