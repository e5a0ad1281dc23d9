"""Motion with dry friction that really holds and play that really opens, batched over rows.

Between events the equations are smooth and Runge-Kutta 4 advances them. An event - a rate
reaches zero under dry friction, a drive lets go, a play has been crossed - is located inside the
sub-step by the method's own interpolant; the row is stepped to it and on from it. At rest,
friction is the force that holds the joint, up to its limit, so a held joint keeps its bits.

Every row has a clock of its own: a row with an event needs more attempts than others to cross its
sub-steps, and nobody waits for it. So the equations, which are Python, are called with many rows
at a time.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sims.events import begin, finish, inputs, keep, locate, settle
from sims.motion import Motion, advance_smoothly
from sims.rows import Clocks, Limits, Mode, Rows, State
from sims.simulator import Array

# Rows advanced together: many enough to hide Python, few enough to stay in the cache.
BLOCK = 4096
# Coefficients of the cubic through values at 0, 1/3, 2/3 and 1.
THROUGH = np.linalg.inv(np.vander(np.arange(4) / 3, increasing=True))


class Attempt(NamedTuple):
    """One step in the mode that holds at its beginning, as if nothing happened before its end.

    Args:
        u: (2, n_a, n) inputs at its beginning and end, straight in between.
        h: (n,) seconds.
        mode: What holds.
        before, after: States at its beginning and end.
        slopes: Rates of change of the state at the four stages of Runge-Kutta.
    """

    u: Array
    h: Array
    mode: Mode
    before: State
    after: State
    slopes: tuple[State, State, State, State]


def move(motion: Motion, state: State, ends: Array, h: Array) -> State:
    """State after all sub-steps, see ``advance``; step by step where nothing holds or opens."""
    if len(h) > BLOCK:
        final = State(*(np.empty_like(part) for part in state))
        for start in range(0, len(h), BLOCK):
            rows = np.arange(start, min(start + BLOCK, len(h)))
            part = move(motion.take(rows), state.take(rows), ends.take(rows, 3), h[rows])
            final.put(rows, part)
        return final
    if motion.dry or motion.plays:
        return advance(motion, state, ends, h)
    for u in ends:
        state = advance_smoothly(motion, state, u, h)
    return state


def advance(motion: Motion, state: State, ends: Array, h: Array) -> State:
    """State after all sub-steps.

    Args:
        motion: What moves.
        state: Where it is.
        ends: Inputs at both ends of every sub-step, (substeps, 2, n_a, n); straight in between.
        h: Length of every row's sub-steps in seconds, (n,).
    """
    final = State(*(np.empty_like(part) for part in state))
    clocks, limits = Clocks.start(len(h)), _limits(motion, state, ends[0, 0])
    while clocks.row.size:
        span, u = (clocks.aim - clocks.began) * h, inputs(ends, clocks)
        if motion.rubs_by_drive:
            limits = _limits(motion, state, u[0])
        attempt = _attempt(motion, limits, state, u, span)
        mode, state, last = attempt.mode, attempt.after, attempt.slopes[3]
        push = motion.drive(state.q, state.v, attempt.u[1]) if motion.plays else state.v
        early = finish(clocks, h, state, last, push, limits, mode)
        if early.size:
            locate(early, clocks, state, push, limits, mode, _ways(motion, attempt, early))
            state.put(early, attempt.before.take(early))
        there = clocks.step == len(ends)
        if there.any():
            done, rest = np.flatnonzero(there), np.flatnonzero(~there)
            final.put(clocks.row[done], state.take(done))
            motion, state, clocks, h = (
                motion.take(rest), state.take(rest), clocks.take(rest), h[rest],
            )  # fmt: skip
            limits = Limits(limits.rest.take(rest, 1), limits.edges.take(rest, 1), limits.joints)
    return final


def _limits(motion: Motion, state: State, u: Array) -> Limits:
    edges = np.empty_like(state.x)
    for i, (_, play) in enumerate(motion.plays):
        edges[i] = 0.5 * play.width
    joints = np.array([j for j, _ in motion.plays], np.intp)
    return Limits(motion.limits(state.q, np.zeros(state.v.shape), u), edges, joints)


def _attempt(motion: Motion, limits: Limits, state: State, u: Array, h: Array) -> Attempt:
    q, v, x = state
    middle, half = 0.5 * (u[0] + u[1]), 0.5 * h
    mode, a1, b1 = _begin(motion, limits, state, u[0])
    held = np.flatnonzero(mode.stuck.any(axis=0))
    stage = _Stages(motion, limits, mode, held)
    v2 = v + half * a1
    a2, b2 = stage.rates(q + half * v, v2, x + half * b1, middle)
    v3 = v + half * a2
    a3, b3 = stage.rates(q + half * v2, v3, x + half * b2, middle)
    v4 = v + h * a3
    a4, b4 = stage.rates(q + h * v3, v4, x + h * b3, u[1])
    sixth = h / 6
    after = State(
        q + sixth * (v + 2 * (v2 + v3) + v4),
        v + sixth * (a1 + 2 * (a2 + a3) + a4),
        x + sixth * (b1 + 2 * (b2 + b3) + b4),
    )
    slopes = State(v, a1, b1), State(v2, a2, b2), State(v3, a3, b3), State(v4, a4, b4)
    return Attempt(u, h, mode, state, after, slopes)


def _begin(motion: Motion, limits: Limits, state: State, u: Array) -> tuple[Mode, Array, Array]:
    """What holds from now on; accelerations and speeds in the play to begin with."""
    q, v, x = state
    mode = Mode(
        np.empty_like(v), np.empty(v.shape, bool), np.empty(x.shape, bool), np.empty_like(x)
    )
    push = motion.drive(q, v, u) if motion.plays else v
    resting = begin(state, push, limits, mode)
    load, running = _loads(motion, limits, mode, q, v, x, u)
    acceleration = motion.accelerate(q, v, u, load)
    if resting.size:
        mobility = motion.mobility(q, v, u, load, acceleration, mode.stuck, resting)
        settle(acceleration, mobility, resting, limits, mode)
    return mode, motion.cap(v, acceleration), running


class _Stages(NamedTuple):
    """What the later stages of Runge-Kutta need: ``held`` rows are those with a stuck joint."""

    motion: Motion
    limits: Limits
    mode: Mode
    held: Rows

    def rates(self, q: Array, v: Array, x: Array, u: Array) -> tuple[Array, Array]:
        """Accelerations and speeds in the play while the mode lasts."""
        motion, stuck, held = self.motion, self.mode.stuck, self.held
        load, running = _loads(motion, self.limits, self.mode, q, v, x, u)
        acceleration = motion.accelerate(q, v, u, load)
        if held.size and len(q) > 1 and not motion.by_force:
            mobility = motion.mobility(q, v, u, load, acceleration, stuck, held)
            keep(acceleration, mobility, held, stuck)
        elif held.size:
            acceleration[stuck] = 0.0
        return motion.cap(v, acceleration), running


def _loads(
    motion: Motion, limits: Limits, mode: Mode, q: Array, v: Array, x: Array, u: Array
) -> tuple[Array, Array]:
    """Forces of effects, friction and open plays on the joints, and speeds in the play."""
    force = -mode.slip * (limits.rest if motion.even else motion.limits(q, v, u))
    running = np.zeros(x.shape)
    if motion.plays and mode.open.any():
        push, free = motion.drive_and_free(q, v, u)
        for i, (j, _) in enumerate(motion.plays):
            force[j] -= np.where(mode.open[i], push[j], 0.0)
            running[i] = np.where(mode.open[i], free[i], 0.0)
    return motion.load(q, v, force), running


def _ways(motion: Motion, attempt: Attempt, rows: Rows) -> Array:
    """Rates, places in the play and drive forces as cubics of the share of the step, by row."""
    before, h = attempt.before.take(rows), attempt.h[rows]
    slopes = [slope.take(rows) for slope in attempt.slopes]
    rates, places = (_cubic(before[k], [slope[k] for slope in slopes], h) for k in (1, 2))
    if not motion.plays:
        return rates
    # What a drive pushes is only known by asking.
    positions = _cubic(before.q, [slope.q for slope in slopes], h)
    motion, u = motion.take(rows), attempt.u.take(rows, 2)
    pushes = []
    for share in np.arange(4) / 3:
        powers = (share ** np.arange(4))[:, None]
        q, v = (np.ascontiguousarray((way * powers).sum(axis=1)) for way in (positions, rates))
        push = motion.drive(q, v, u[0] + share * (u[1] - u[0]))
        pushes.append([push[j] for j, _ in motion.plays])
    values = np.array(pushes)
    drives = sum(THROUGH[:, k, None] * values[k][:, None] for k in range(4))
    return np.concatenate([rates, places, drives])


def _cubic(start: Array, slopes: list[Array], h: Array) -> Array:
    """Coefficients of the third-order interpolant of Runge-Kutta 4, (count, 4, n).

    Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, II.6.
    """
    one, two, three, four = slopes
    found = np.empty((len(start), 4, len(h)))
    found[:, 0], found[:, 1] = start, h * one
    found[:, 2] = h * (two + three - 1.5 * one - 0.5 * four)
    found[:, 3] = h * (2 / 3) * (one - two - three + four)
    return found
