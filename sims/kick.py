"""A driven joint of fixed inertia, row by row, compiled: leapfrog with exact stops.

The angle moves at a constant rate and the rate is kicked in between, which is how Pymunk steps a
body. Dry friction and play make the rate's equation non-smooth: each kick is solved from event
to event, Runge-Kutta 4 between them, and each located by false position.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sims.compiled import call_at, compiled
from sims.driven import DrivenJoint, Field
from sims.simulator import Array

MOST_EVENTS = 6

# How a mode of motion can end.
LETS_GO, LOWER, STOPS, UPPER = range(4)


class Mode(NamedTuple):
    """What holds between two events: a constant load and input, sliding or stuck, play or none."""

    angle: float
    load: float
    u: float
    slip: int
    side: int
    opened: bool
    stuck: bool


@compiled
def swing_rows(
    states: Array, inputs: Array, durations: Array, numbers: Array, springs: Array, waves: Array,
    own: tuple[int, int, int],
) -> Array:  # fmt: skip
    """Every row after its duration.

    Args:
        states: (n, 3): angle, rate, place in the play.
        inputs: (n, 2 m): mean input in each half of m sub-steps.
        durations: (n,) seconds.
        numbers: (n, 12): ``DrivenJoint`` without addresses, then ``weight`` and ``constant``.
        springs, waves: (n, k, 3), see ``Field``.
        own: Addresses of ``DrivenJoint`` and ``Field``, the same for all rows.

    Returns:
        States at the end. Leapfrog errs in even powers of the sub-step; a second pass with twice
        the sub-step removes the second.
    """
    after = np.empty_like(states)
    whole = np.empty(inputs.shape[1] // 2)
    for i in range(len(states)):
        for k in range(len(whole)):
            whole[k] = 0.5 * (inputs[i, 2 * k] + inputs[i, 2 * k + 1])
        a = numbers[i]
        joint = DrivenJoint(
            a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7], a[8], a[9], own[0], own[1]
        )  # fmt: skip
        field = Field(a[10], a[11], springs[i], waves[i], own[2])
        angle, rate, x = states[i]
        fine = swing(joint, field, angle, rate, x, inputs[i], durations[i])
        coarse = swing(joint, field, angle, rate, x, whole, durations[i])
        for c in range(3):
            after[i, c] = fine[c] + (fine[c] - coarse[c]) / 3
        if joint.width > 0:
            after[i, 2] = max(-0.5 * joint.width, min(0.5 * joint.width, after[i, 2]))
    return after


@compiled
def swing(
    joint: DrivenJoint,
    field: Field,
    angle: float,
    rate: float,
    x: float,
    inputs: Array,
    duration: float,
) -> tuple[float, float, float]:
    """Angle, rate and place in the play after a duration.

    An angle that starts half a sub-step back is at the middle of the sub-step when the torque
    acts; ``middle`` is that angle.
    """
    h = duration / len(inputs)
    inverse = 1.0 / joint.inertia
    behind = angle - 0.5 * h * rate
    middle = angle + 0.5 * h * rate
    kicked = joint.own_torque != 0 or joint.drag != 0 or joint.width > 0 or limit(joint, 0.0) > 0
    # The torque that, held for h, has the effect of damping that follows the rate.
    friction = joint.damping + joint.back
    pull = joint.inertia * math.expm1(-friction / joint.inertia * h) / h
    push = -pull / friction if friction > 0 else 1.0
    for u in inputs:
        load = field.weight * math.sin(middle) + standing(field, middle)
        behind += h * rate
        if not kicked:
            rate += (pull * rate + push * (load + joint.drive * u)) * inverse * h
        else:
            wanted, x, moved = kick(joint, middle, rate, x, load, u, h)
            # Held is held: no rate is left by rounding.
            rate += joint.inertia * (wanted - rate) / h * inverse * h if wanted != 0 else -rate
            behind += moved
            middle += moved
        middle += h * rate
    return behind + 0.5 * h * rate, rate, x


@compiled
def standing(field: Field, angle: float) -> float:
    """Torque of the effects that depend on the angle alone."""
    total = field.constant
    for k in range(len(field.springs)):
        away = angle - field.springs[k, 1]
        total -= field.springs[k, 0] * (away if field.springs[k, 2] == 1 else away * away * away)
    for k in range(len(field.waves)):
        turns = field.waves[k, 2] * angle
        total += field.waves[k, 0] * math.sin(turns) + field.waves[k, 1] * math.cos(turns)
    if field.own != 0:
        total += call_at(field.own, angle, 0.0)
    return total


@compiled
def limit(joint: DrivenJoint, rate: float) -> float:
    """Size of the dry friction."""
    size = joint.coulomb
    if joint.sliding != 0 or joint.breakaway != 0:
        ratio = rate / joint.speed
        excess = max(joint.breakaway - joint.sliding, 0.0)
        size += joint.sliding + excess * math.exp(-ratio * ratio)
    if joint.own_limit != 0:
        size += call_at(joint.own_limit, abs(rate), 0.0)
    return size


@compiled
def pushing(joint: DrivenJoint, rate: float, u: float) -> float:
    """Torque of the motor."""
    return joint.drive * u - joint.back * rate


@compiled
def torque(joint: DrivenJoint, angle: float, rate: float, load: float) -> float:
    """Torque on the joint but for its motor and its dry friction."""
    total = load - joint.damping * rate
    if joint.drag != 0:
        total -= joint.drag * rate * abs(rate)
    if joint.own_torque != 0:
        total += call_at(joint.own_torque, angle, rate)
    return total


@compiled
def kick(
    joint: DrivenJoint, angle: float, rate: float, x: float, load: float, u: float, h: float
) -> tuple[float, float, float]:
    """Rate and place in the play after ``h`` seconds under a constant ``load`` and input.

    The third value is what leapfrog lacks in the position after an event: the integral of the
    rate less ``h`` times the mean of its ends. Without events it is zero.
    """
    edge = 0.5 * joint.width
    holds = limit(joint, 0.0)
    left, first, moved = h, rate, 0.0
    slip, later, place = 0, rate, x
    for events in range(MOST_EVENTS, -1, -1):
        push = pushing(joint, rate, u)
        side = 0
        if joint.width > 0:
            side = 1 if x >= edge and push >= 0 else -1 if x <= -edge and push <= 0 else 0
        opened = joint.width > 0 and side == 0
        slip = int(rate > 0) - int(rate < 0) if holds > 0 else 0
        if holds > 0 and rate == 0:
            pull = torque(joint, angle, 0.0, load) + (0.0 if opened else push)
            slip = int(pull > holds) - int(pull < -holds)
        mode = Mode(angle, load, u, slip, side, opened, holds > 0 and slip == 0)
        later, place = after(joint, mode, rate, x, left)
        share, end = left, -1
        if events > 0:
            # The first of the ends; what it makes zero is then made exactly zero.
            for kind in range(4):
                if margin(joint, mode, kind, later, place) < 0:
                    time = time_of(joint, mode, kind, rate, x, left)
                    if end < 0 or time < share:
                        share, end = time, kind
        if end < 0:
            break
        began = rate
        rate, x = after(joint, mode, rate, x, share)
        if end == STOPS:
            rate = 0.0
        elif end == LETS_GO:
            # Just off the edge, or a push left by rounding would close the play again.
            x = side * edge * (1 - 1e-12)
        else:
            x = edge if end == UPPER else -edge
        moved += 0.5 * share * (began + rate)
        left -= share
    began = rate
    rate = 0.0 if slip * later < 0 else later
    if left < h:
        moved += 0.5 * left * (began + rate) - 0.5 * h * (first + rate)
    return rate, max(-edge, min(edge, place)), moved


@compiled
def slope(joint: DrivenJoint, mode: Mode, rate: float) -> tuple[float, float]:
    """Acceleration, and speed in the play."""
    push = pushing(joint, rate, mode.u)
    running = push / joint.back if mode.opened else 0.0
    if mode.stuck:
        return 0.0, running
    total = torque(joint, mode.angle, rate, mode.load)
    if not mode.opened:
        total += push
    if mode.slip != 0:
        total -= mode.slip * limit(joint, rate)
    return total / joint.inertia, running


@compiled
def after(joint: DrivenJoint, mode: Mode, rate: float, x: float, h: float) -> tuple[float, float]:
    """Rate and place in the play while the mode lasts, ``h`` seconds on."""
    a1, b1 = slope(joint, mode, rate)
    a2, b2 = slope(joint, mode, rate + 0.5 * h * a1)
    a3, b3 = slope(joint, mode, rate + 0.5 * h * a2)
    a4, b4 = slope(joint, mode, rate + h * a3)
    return rate + h / 6 * (a1 + 2 * (a2 + a3) + a4), x + h / 6 * (b1 + 2 * (b2 + b3) + b4)


@compiled
def margin(joint: DrivenJoint, mode: Mode, end: int, rate: float, x: float) -> float:
    """Positive while the mode lasts, negative beyond its end; 1 for an end that it cannot have."""
    if end == STOPS:
        return mode.slip * rate if mode.slip != 0 else 1.0
    if end == LETS_GO:
        return mode.side * pushing(joint, rate, mode.u) if mode.side != 0 else 1.0
    if not mode.opened:
        return 1.0
    edge = 0.5 * joint.width
    return edge - x if end == UPPER else edge + x


@compiled
def time_of(
    joint: DrivenJoint, mode: Mode, end: int, rate: float, x: float, within: float
) -> float:
    """When a mode ends that has ended ``within`` seconds.

    False position with the Illinois rule; a start at zero is left behind first.
    """
    low, high = 0.0, within
    at_low = margin(joint, mode, end, rate, x)
    at_high = margin(joint, mode, end, *after(joint, mode, rate, x, high))
    tiny = 1e-14 * abs(at_high)
    if at_low <= 0:
        low = 1e-3 * within
        at_low = margin(joint, mode, end, *after(joint, mode, rate, x, low))
        if at_low <= 0:
            return low
    kept, middle = 0, high
    for _ in range(40):
        middle = (low * at_high - high * at_low) / (at_high - at_low)
        found = margin(joint, mode, end, *after(joint, mode, rate, x, middle))
        if abs(found) <= tiny or high - low < 1e-14 * within:
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
