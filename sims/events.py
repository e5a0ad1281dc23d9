"""Dry friction and play in the rows of a batch: what holds, what ends it, and when; compiled.

Joints first and rows last, as in ``sims.sliding``, and everything in place. Events are counted
from 0: joint j stops; then, of each play, its drive lets go, has crossed it upwards, downwards.
A row whose numbers are not finite gets NaN and leaves the others alone.
"""

from __future__ import annotations

import numpy as np

from sims.compiled import compiled, inlined
from sims.rows import MOST_EVENTS, Clocks, Limits, Mask, Mode, Rows, State
from sims.simulator import Array

# Arrays are taken out of their tuples once: inside a loop each access would count a reference.


@compiled
def inputs(ends: Array, clocks: Clocks) -> Array:
    """Inputs at both ends of every attempt, (2, n_a, n), from those of sub-steps."""
    row, step, begins, aims, _, _ = clocks
    found = np.empty((2, ends.shape[2], len(row)))
    for r in range(len(row)):
        began, aim = begins[r], aims[r]
        for k in range(ends.shape[2]):
            first, last = ends[step[r], 0, k, row[r]], ends[step[r], 1, k, row[r]]
            found[0, k, r] = first if began == 0 else first + began * (last - first)
            found[1, k, r] = last if aim == 1 else first + aim * (last - first)
    return found


@compiled
def begin(state: State, push: Array, limits: Limits, mode: Mode) -> Rows:
    """What holds from now on, but for joints at rest; the rows that have such joints.

    ``push`` is the drive force, (n_joints, n), used only where there are plays.
    """
    _, v, x = state
    rest, edges, driven = limits
    slip, stuck, opened, side = mode
    joints, n = v.shape
    resting = np.empty(n, np.intp)
    count = 0
    for r in range(n):
        for i in range(len(driven)):
            edge, drive = edges[i, r], push[driven[i], r]
            side[i, r] = 0.0
            if edge > 0 and x[i, r] >= edge and drive >= 0:
                side[i, r] = 1.0
            elif edge > 0 and x[i, r] <= -edge and drive <= 0:
                side[i, r] = -1.0
            opened[i, r] = edge > 0 and side[i, r] == 0
        rests = False
        for j in range(joints):
            slip[j, r] = np.sign(v[j, r]) if rest[j, r] > 0 else 0.0
            stuck[j, r] = rest[j, r] > 0 and v[j, r] == 0
            rests = rests or stuck[j, r]
        if rests:
            resting[count] = r
            count += 1
    return resting[:count]


@compiled
def settle(acceleration: Array, mobility: Array, rows: Rows, limits: Limits, mode: Mode) -> None:
    """Which joints at rest friction can hold; the others slip the way they are pulled.

    Args:
        acceleration: (n_joints, n) without friction on joints at rest; then with it.
        mobility: (n_joints, n_joints, n_rows): acceleration of the second joint per force on
            the first, for each of ``rows`` and its joints at rest.
        rows: Those with joints at rest.
        limits: What friction can hold.
        mode: Joints at rest are marked as stuck.
    """
    rest, (slip, stuck, _, _) = limits.rest, mode
    joints = len(acceleration)
    matrix, hold = np.empty((joints, joints + 1)), np.zeros(joints)
    for m in range(len(rows)):
        r = rows[m]
        for _ in range(joints):
            _solve(acceleration, mobility, stuck, m, r, matrix, hold)
            worst, most = -1, 1.0
            for j in range(joints):
                excess = abs(hold[j]) / rest[j, r] if stuck[j, r] else 0.0
                if not excess <= most:  # NaN is not held either
                    worst, most = j, excess
            if worst < 0:
                break
            # Let go one joint at a time: its slipping may relieve the others.
            stuck[worst, r], slip[worst, r] = False, -np.sign(hold[worst])
            for i in range(joints):
                acceleration[i, r] -= mobility[worst, i, m] * (slip[worst, r] * rest[worst, r])
        _keep(acceleration, mobility, stuck, m, r, matrix, hold)


@compiled
def keep(acceleration: Array, mobility: Array, rows: Rows, stuck: Mask) -> None:
    """Accelerations when friction holds the stuck joints of ``rows``; as for ``settle``."""
    joints = len(acceleration)
    matrix, hold = np.empty((joints, joints + 1)), np.zeros(joints)
    for m in range(len(rows)):
        _keep(acceleration, mobility, stuck, m, rows[m], matrix, hold)


@inlined
def _keep(
    acceleration: Array, mobility: Array, stuck: Mask, m: int, r: int, matrix: Array, hold: Array
) -> None:
    joints = len(acceleration)
    _solve(acceleration, mobility, stuck, m, r, matrix, hold)
    for j in range(joints):
        if stuck[j, r]:
            for i in range(joints):
                acceleration[i, r] += mobility[j, i, m] * hold[j]
    for j in range(joints):
        if stuck[j, r]:
            acceleration[j, r] = 0.0


@inlined
def _solve(
    acceleration: Array, mobility: Array, stuck: Mask, m: int, r: int, matrix: Array, hold: Array
) -> None:
    """Forces that keep the stuck joints of a row from accelerating, by Gauss's elimination."""
    joints = len(acceleration)
    for i in range(joints):
        for j in range(joints):
            both = stuck[i, r] and stuck[j, r]
            matrix[i, j] = mobility[j, i, m] if both else (1.0 if i == j else 0.0)
        matrix[i, joints] = -acceleration[i, r] if stuck[i, r] else 0.0
    for k in range(joints):
        pivot = k
        for i in range(k + 1, joints):
            if abs(matrix[i, k]) > abs(matrix[pivot, k]):
                pivot = i
        for j in range(joints + 1):
            matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
        for i in range(k + 1, joints):
            if matrix[i, k] != 0:
                share = matrix[i, k] / matrix[k, k]
                for j in range(k, joints + 1):
                    matrix[i, j] -= share * matrix[k, j]
    for k in range(joints - 1, -1, -1):
        left = matrix[k, joints]
        for j in range(k + 1, joints):
            left -= matrix[k, j] * hold[j]
        # A force that moves nothing holds nothing, but what is not pulled needs no force.
        hold[k] = left / matrix[k, k] if left != 0 else 0.0


@compiled
def finish(
    clocks: Clocks, h: Array, after: State, last: State, push: Array, limits: Limits, mode: Mode
) -> Rows:
    """End every attempt that may end: events that were aimed at, and sub-steps without any.

    Args:
        clocks: Set to where the next attempt begins.
        h: (n,) length of the sub-steps in seconds.
        after: State at the end of the attempts; made exact where an event has happened.
        last: Rates of change at their end.
        push: As for ``begin``, at their end.
        limits, mode: What can hold and what did.

    Returns:
        Rows in which something has ended before its time.
    """
    _, step, began, aims, event, left = clocks
    _, edges, driven = limits
    slip, _, opened, side = mode
    q, v, x = after
    dq, dv, dx = last
    joints, n = v.shape
    early = np.empty(n, np.intp)
    count = 0
    for r in range(n):
        aim = aims[r]
        if event[r] < 0:
            ended = False
            for j in range(joints):
                ended = ended or slip[j, r] * v[j, r] < 0
            for i in range(len(driven)):
                ended = ended or side[i, r] * push[driven[i], r] < 0
                ended = ended or (opened[i, r] and abs(x[i, r]) > edges[i, r])
            if ended and left[r] > 0:
                early[count] = r
                count += 1
                continue
            for j in range(joints):
                if slip[j, r] * v[j, r] < 0:
                    v[j, r] = 0.0
        else:
            k, i, way = event[r], (event[r] - joints) // 3, (event[r] - joints) % 3
            edge = 0.0 if k < joints else edges[i, r] if way == 1 else -edges[i, r]
            # What the interpolant missed, to first order.
            late = 0.0
            if k < joints:
                late = -v[k, r] / dv[k, r]
            elif way > 0:
                late = (edge - x[i, r]) / dx[i, r]
            if abs(late) < 0.1 * h[r] * (aim - began[r]):
                aim = min(aim + late / h[r], 1.0)
                for j in range(joints):
                    q[j, r] += late * dq[j, r]
                    v[j, r] += late * dv[j, r]
                for j in range(len(driven)):
                    x[j, r] += late * dx[j, r]
            if k < joints:
                v[k, r] = 0.0
            elif way > 0:
                x[i, r] = edge
            else:
                # Just off the edge, or the push left by rounding would close the play again.
                x[i, r] = side[i, r] * edges[i, r] * (1 - 1e-12)
        event[r], aims[r], began[r] = -1, 1.0, aim
        if aim == 1:
            began[r], left[r] = 0.0, MOST_EVENTS
            step[r] += 1
    return early[:count]


@compiled
def locate(
    rows: Rows, clocks: Clocks, after: State, push: Array, limits: Limits, mode: Mode, ways: Array
) -> None:
    """Set the clocks of some rows to try again, up to the first of the events that ended them.

    Args:
        rows: See ``finish``.
        clocks, after, push, limits, mode: As for ``finish``.
        ways: (n_joints + 2 n_plays, 4, n_rows): coefficients, over the share of the attempt, of
            every rate, of every place in a play, and of the drive force at every play.
    """
    _, _, began, aim, event, left = clocks
    _, edges, driven = limits
    slip, _, opened, side = mode
    _, v, x = after
    joints, plays = len(v), len(driven)
    for m in range(len(rows)):
        r = rows[m]
        first = 2.0
        for j in range(joints):
            if slip[j, r] * v[j, r] < 0:
                share = _zero(ways, j, m, 0.0, slip[j, r])
                if share < first:
                    first, event[r] = share, j
        for i in range(plays):
            k = joints + 3 * i
            if side[i, r] * push[driven[i], r] < 0:
                share = _zero(ways, joints + plays + i, m, 0.0, side[i, r])
                if share < first:
                    first, event[r] = share, k
            if opened[i, r] and abs(x[i, r]) > edges[i, r]:
                share = _zero(ways, joints + i, m, edges[i, r], -np.sign(x[i, r]))
                if share < first:
                    first, event[r] = share, k + (1 if x[i, r] > 0 else 2)
        left[r] -= 1
        aim[r] = began[r] + max(first, 1e-9) * (1 - began[r])


@compiled
def _zero(ways: Array, k: int, m: int, offset: float, sign: float) -> float:
    """Where in (0, 1] a cubic that is negative at 1 first turns negative."""
    a, b = offset + sign * ways[k, 0, m], sign * ways[k, 1, m]
    c, d = sign * ways[k, 2, m], sign * ways[k, 3, m]
    low, high = 0.0, 0.125
    while high < 1.0 and a + high * (b + high * (c + high * d)) >= 0:
        low, high = high, high + 0.125
    while high - low > 1e-15:
        middle = 0.5 * (low + high)
        if a + middle * (b + middle * (c + middle * d)) < 0:
            high = middle
        else:
            low = middle
    return high
