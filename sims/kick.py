"""The rate of one driven joint while its position stands still: half of a leapfrog.

Dry friction and play make the rate's equation non-smooth. Here it is solved for one sub-step
from event to event: Runge-Kutta 4 between them, and each located by false position.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

from sims.effects.friction import DryFriction
from sims.effects.joint import JointEffect

MOST_EVENTS = 6


@dataclasses.dataclass(frozen=True)
class DrivenJoint:
    """A joint of fixed inertia with a motor; scalars, SI units.

    Args:
        inertia: About the joint.
        damping: Torque of the bearing per rate.
        drive: Motor torque per input at rest.
        back: Loss of motor torque per rate.
        smooth: Effects that depend on the rate.
        dry: Dry friction.
        width: Play between motor and joint.
    """

    inertia: float
    damping: float
    drive: float
    back: float
    smooth: Sequence[JointEffect] = ()
    dry: Sequence[DryFriction] = ()
    width: float = 0.0

    def limit(self, rate: float) -> float:
        """Size of the dry friction."""
        size = 0.0
        for effect in self.dry:
            size += float(effect.limit(abs(rate)))
        return size

    def push(self, rate: float, u: float) -> float:
        """Torque of the motor."""
        return self.drive * u - self.back * rate

    def torque(self, angle: float, rate: float, load: float, u: float, opened: bool) -> float:
        """Torque on the joint but for its dry friction."""
        total = load - self.damping * rate
        if not opened:
            total += self.push(rate, u)
        for effect in self.smooth:
            total += float(effect.force(angle, rate))
        return total


def kick(
    joint: DrivenJoint, angle: float, rate: float, x: float, load: float, u: float, h: float
) -> tuple[float, float, float]:
    """Rate and place in the play after ``h`` seconds under a constant ``load`` and input.

    The third value is what leapfrog lacks in the position after an event: the integral of the
    rate less ``h`` times the mean of its ends. Without events it is zero.
    """
    edge = 0.5 * joint.width
    holds = joint.limit(0.0)
    left = h
    first, moved = rate, 0.0
    for events in range(MOST_EVENTS, -1, -1):
        pushing = joint.push(rate, u)
        side = 0
        if joint.width > 0:
            side = 1 if x >= edge and pushing >= 0 else -1 if x <= -edge and pushing <= 0 else 0
        opened = joint.width > 0 and side == 0
        slip = int(rate > 0) - int(rate < 0) if holds > 0 else 0
        if holds > 0 and rate == 0:
            pull = joint.torque(angle, 0.0, load, u, opened)
            slip = int(pull > holds) - int(pull < -holds)
        mode = _Mode(joint, angle, load, u, slip, side, opened, stuck=holds > 0 and slip == 0)
        after = mode.after(rate, x, left)
        over = [end for end in mode.ends() if mode.margin(end, *after) < 0]
        if not over or events == 0:
            break
        began = rate
        # The first of the ends; what it makes zero is then made exactly zero.
        share, end = min((mode.time_of(end, rate, x, left), end) for end in over)
        rate, x = mode.after(rate, x, share)
        if end == "stops":
            rate = 0.0
        elif end == "lets go":
            # Just off the edge, or a push left by rounding would close the play again.
            x = side * edge * (1 - 1e-12)
        else:
            x = edge if end == "upper" else -edge
        moved += 0.5 * share * (began + rate)
        left -= share
    began, (rate, x) = rate, after
    rate = 0.0 if slip * rate < 0 else rate
    if left < h:
        moved += 0.5 * left * (began + rate) - 0.5 * h * (first + rate)
    return rate, max(-edge, min(edge, x)), moved


@dataclasses.dataclass(frozen=True)
class _Mode:
    """What holds between two events: sliding or stuck, play closed on a side or open."""

    joint: DrivenJoint
    angle: float
    load: float
    u: float
    slip: int
    side: int
    opened: bool
    stuck: bool

    def slope(self, rate: float) -> tuple[float, float]:
        joint = self.joint
        running = joint.push(rate, self.u) / joint.back if self.opened else 0.0
        if self.stuck:
            return 0.0, running
        torque = joint.torque(self.angle, rate, self.load, self.u, self.opened)
        if self.slip:
            torque -= self.slip * joint.limit(rate)
        return torque / joint.inertia, running

    def after(self, rate: float, x: float, h: float) -> tuple[float, float]:
        a1, b1 = self.slope(rate)
        a2, b2 = self.slope(rate + 0.5 * h * a1)
        a3, b3 = self.slope(rate + 0.5 * h * a2)
        a4, b4 = self.slope(rate + h * a3)
        return rate + h / 6 * (a1 + 2 * (a2 + a3) + a4), x + h / 6 * (b1 + 2 * (b2 + b3) + b4)

    def ends(self) -> list[str]:
        """The ways in which it can end."""
        found = ["stops"] if self.slip else []
        if self.side:
            found.append("lets go")
        return [*found, "upper", "lower"] if self.opened else found

    def margin(self, end: str, rate: float, x: float) -> float:
        """Positive while the mode lasts, negative beyond its end."""
        if end == "stops":
            return self.slip * rate
        if end == "lets go":
            return self.side * self.joint.push(rate, self.u)
        edge = 0.5 * self.joint.width
        return edge - x if end == "upper" else edge + x

    def time_of(self, end: str, rate: float, x: float, h: float) -> float:
        """When the mode ends, within ``h``."""
        return _first_zero(lambda t: self.margin(end, *self.after(rate, x, t)), h)


def _first_zero(function: Callable[[float], float], end: float) -> float:
    """Where a function that is positive just after 0 and negative at ``end`` is zero.

    False position with the Illinois rule; a start at zero is left behind first.
    """
    low, high = 0.0, end
    at_low, at_high = function(low), function(high)
    tiny = 1e-14 * abs(at_high)
    if at_low <= 0:
        low = 1e-3 * end
        at_low = function(low)
        if at_low <= 0:
            return low
    kept = 0
    for _ in range(40):
        middle = (low * at_high - high * at_low) / (at_high - at_low)
        found = function(middle)
        if abs(found) <= tiny or high - low < 1e-14 * end:
            return middle
        if found < 0:
            high, at_high = middle, found
            at_low *= 0.5 if kept < 0 else 1.0
            kept = -1
        else:
            low, at_low = middle, found
            at_high *= 0.5 if kept > 0 else 1.0
            kept = 1
    return middle
