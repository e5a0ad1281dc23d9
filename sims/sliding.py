"""Motion with dry friction that really holds and play that really opens, batched over rows.

Between events the equations are smooth and Runge-Kutta 4 advances them. An event - a rate
reaches zero under dry friction, a drive lets go, a play has been crossed - is located inside
the sub-step, and the rows that have one are stepped to it and on from it. At rest, friction is
the force that holds the joint, up to its limit, so a held joint keeps its bits.

Arrays have joints first and rows last, (n_joints, n): a column of one quantity is then
contiguous, which NumPy needs to round equally in every batch. An input runs straight from its
value at the start of a sub-step to its value at the end: (2, n_a, n).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sims.effects.backlash import Backlash
from sims.effects.friction import DryFriction
from sims.effects.joint import JointEffect
from sims.simulator import Array

Rows = NDArray[np.intp]
Mask = NDArray[np.bool_]

# Events that one row may have within a sub-step; after these, rates that would change their
# sign against friction are set to zero.
MOST_EVENTS = 6


@dataclasses.dataclass(frozen=True)
class Motion:
    """What moves: accelerations, and the forces that are added to them.

    Args:
        acceleration: (q, v, u, force, parameters) -> accelerations; all (n_joints, n) but
            u (n_a, n).
        drive_force: (q, v, u, parameters) -> (n_joints, n), or None.
        parameters: Scalars or (n,).
        smooth, dry, plays: Effects with the number of the joint they act on.
    """

    acceleration: Callable[[Array, Array, Array, Array, dict[str, Any]], Array]
    drive_force: Callable[[Array, Array, Array, dict[str, Any]], Array]
    parameters: dict[str, Any]
    smooth: tuple[tuple[int, JointEffect], ...] = ()
    dry: tuple[tuple[int, DryFriction], ...] = ()
    plays: tuple[tuple[int, Backlash], ...] = ()

    def take(self, rows: Rows) -> Motion:
        """The same for some rows."""
        return dataclasses.replace(
            self,
            parameters={k: p[rows] if np.ndim(p) else p for k, p in self.parameters.items()},
            smooth=tuple((j, effect.take(rows)) for j, effect in self.smooth),
            dry=tuple((j, effect.take(rows)) for j, effect in self.dry),
            plays=tuple((j, effect.take(rows)) for j, effect in self.plays),
        )

    def accelerate(self, q: Array, v: Array, u: Array, force: Array | None = None) -> Array:
        """Accelerations under the smooth effects and a further force."""
        total = np.zeros_like(q) if force is None else force.copy()
        for j, effect in self.smooth:
            total[j] += effect.force(q[j], v[j])
        return self.acceleration(q, v, u, total, self.parameters)

    def limits(self, v: Array) -> Array:
        """Size of the dry friction on every joint."""
        size = np.zeros_like(v)
        for j, effect in self.dry:
            size[j] += effect.limit(np.abs(v[j]))
        return size


@dataclasses.dataclass
class State:
    """Positions q and rates v (n_joints, n), and places in the play x (n_plays, n)."""

    q: Array
    v: Array
    x: Array

    def take(self, rows: Rows) -> State:
        """The same for some rows."""
        return State(self.q[:, rows], self.v[:, rows], self.x[:, rows])

    def put(self, rows: Rows, other: State) -> None:
        """Overwrite some rows."""
        self.q[:, rows], self.v[:, rows], self.x[:, rows] = other.q, other.v, other.x


@dataclasses.dataclass(frozen=True)
class Mode:
    """What holds between two events.

    Args:
        slip: (n_joints, n) sign of the rate that dry friction opposes, 0 where there is none.
        stuck: (n_joints, n) joints that friction holds.
        open: (n_plays, n) drives that run across their play.
        side: (n_plays, n) side on which a closed play transmits, 0 where there is no play.
    """

    slip: Array
    stuck: Mask
    open: Mask
    side: Array

    def take(self, rows: Rows) -> Mode:
        """The same for some rows."""
        return Mode(*(getattr(self, f.name)[:, rows] for f in dataclasses.fields(self)))


def advance(motion: Motion, state: State, u: Array, h: Array, events: int = MOST_EVENTS) -> State:
    """State after ``h`` seconds, (n,), under inputs ``u`` (2, n_a, n)."""
    mode = _mode(motion, state, u[0])
    held = mode.stuck.any(axis=0)
    if not held.any():
        return _between_events(motion, state, u, h, mode, events)
    after = State(state.q.copy(), state.v.copy(), state.x.copy())
    # Where everything is held nothing has to be computed, unless a drive crosses its play.
    busy = held & ~(mode.stuck.all(axis=0) & (len(motion.plays) == 0))
    for rows in (np.flatnonzero(~held), np.flatnonzero(busy)):
        if rows.size:
            part = _between_events(
                motion.take(rows), state.take(rows), u[..., rows], h[rows], mode.take(rows), events
            )
            after.put(rows, part)
    return after


def advance_smoothly(motion: Motion, state: State, u: Array, h: Array) -> State:
    """The same without dry friction and play."""
    return runge_kutta(lambda q, v, x, u: (motion.accelerate(q, v, u), x), state, u, h)


def runge_kutta(
    rates: Callable[[Array, Array, Array, Array], tuple[Array, Array]],
    state: State,
    u: Array,
    h: Array,
) -> State:
    """One classical fourth-order step of q'' = a(q, v, x, u), x' = b(q, v, x, u)."""
    q, v, x = state.q, state.v, state.x
    middle = 0.5 * (u[0] + u[1])
    half = 0.5 * h
    a1, b1 = rates(q, v, x, u[0])
    v2 = v + half * a1
    a2, b2 = rates(q + half * v, v2, x + half * b1, middle)
    v3 = v + half * a2
    a3, b3 = rates(q + half * v2, v3, x + half * b2, middle)
    v4 = v + h * a3
    a4, b4 = rates(q + h * v3, v4, x + h * b3, u[1])
    sixth = h / 6
    return State(
        q + sixth * (v + 2 * (v2 + v3) + v4),
        v + sixth * (a1 + 2 * (a2 + a3) + a4),
        x + sixth * (b1 + 2 * (b2 + b3) + b4),
    )


def _step(motion: Motion, state: State, u: Array, h: Array, mode: Mode) -> State:
    after = runge_kutta(lambda q, v, x, u: _rates(motion, q, v, x, u, mode), state, u, h)
    after.v[mode.stuck] = 0.0
    return after


def _forces(
    motion: Motion, q: Array, v: Array, x: Array, u: Array, mode: Mode
) -> tuple[Array, Array]:
    """Forces of friction and of open plays on the joints, and speeds in the play."""
    force = -mode.slip * motion.limits(v)
    running = np.zeros_like(x)
    if motion.plays:
        push, free = _drive(motion, q, v, u)
        for i, (j, _) in enumerate(motion.plays):
            force[j] -= np.where(mode.open[i], push[j], 0.0)
            running[i] = np.where(mode.open[i], free[i], 0.0)
    return force, running


def _rates(
    motion: Motion, q: Array, v: Array, x: Array, u: Array, mode: Mode
) -> tuple[Array, Array]:
    """Accelerations and speeds in the play while a mode lasts."""
    force, running = _forces(motion, q, v, x, u, mode)
    acceleration = motion.accelerate(q, v, u, force)
    if mode.stuck.any():
        mobility = _mobility(motion, q, v, u, force, acceleration)
        holding = _holding(mobility, acceleration, mode.stuck)
        for j in range(len(q)):
            acceleration = acceleration + mobility[j] * holding[j]
        acceleration[mode.stuck] = 0.0
    return acceleration, running


def _drive(motion: Motion, q: Array, v: Array, u: Array) -> tuple[Array, Array]:
    """Drive force on every joint, and each drive's free speed across its play."""
    push = motion.drive_force(q, v, u, motion.parameters)
    free = np.zeros((len(motion.plays), q.shape[1]))
    for i, (j, _) in enumerate(motion.plays):
        faster = v.copy()
        faster[j] += 1.0
        slope = push[j] - motion.drive_force(q, faster, u, motion.parameters)[j]
        free[i] = push[j] / slope
    return push, free


def _mobility(
    motion: Motion, q: Array, v: Array, u: Array, force: Array, acceleration: Array
) -> Array:
    """Acceleration of joint i per unit force on joint j, as [j, i, row]."""
    found = np.empty((len(q), *q.shape))
    for j in range(len(q)):
        more = force.copy()
        more[j] += 1.0
        found[j] = motion.accelerate(q, v, u, more) - acceleration
    return found


def _holding(mobility: Array, acceleration: Array, stuck: Mask) -> Array:
    """Forces that keep the stuck joints from accelerating, zero on the others."""
    if len(acceleration) == 1:
        # A force that moves nothing holds nothing: the joint then slips.
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(stuck, -acceleration / mobility[0], 0.0)
    both = stuck[:, None] & stuck[None]
    matrix = np.where(both, mobility, np.eye(len(stuck))[:, :, None]).transpose(2, 1, 0)
    wanted = np.where(stuck, -acceleration, 0.0).T[:, :, None]
    return np.linalg.solve(matrix, wanted)[:, :, 0].T


def _mode(motion: Motion, state: State, u: Array) -> Mode:
    """What holds from now on: which joints slip, which are held, which plays are open."""
    q, v, x = state.q, state.v, state.x
    opened, side = np.zeros(x.shape, dtype=bool), np.zeros_like(x)
    if motion.plays:
        push = motion.drive_force(q, v, u, motion.parameters)
        for i, (j, play) in enumerate(motion.plays):
            # Rows without play have nothing to close.
            there = np.broadcast_to(np.asarray(play.width) > 0, x[i].shape)
            edge = 0.5 * play.width
            side[i] = np.where((x[i] >= edge) & (push[j] >= 0), 1.0, 0.0)
            side[i] = np.where((x[i] <= -edge) & (push[j] <= 0), -1.0, side[i])
            side[i] = np.where(there, side[i], 0.0)
            opened[i] = there & (side[i] == 0)
    limit = motion.limits(np.zeros_like(v))
    slip = np.where(limit > 0, np.sign(v), 0.0)
    resting = (limit > 0) & (v == 0)
    stuck = np.zeros(v.shape, dtype=bool)
    mode = Mode(slip, stuck, opened, side)
    rows = np.flatnonzero(resting.any(axis=0))
    if rows.size:
        part = _settle(
            motion.take(rows),
            state.take(rows),
            u[:, rows],
            mode.take(rows),
            resting[:, rows],
            limit[:, rows],
        )
        slip[:, rows], stuck[:, rows] = part.slip, part.stuck
    return mode


def _settle(
    motion: Motion, state: State, u: Array, mode: Mode, resting: Mask, limit: Array
) -> Mode:
    """Which resting joints friction can hold; the others slip the way they are pulled."""
    q, v, x = state.q, state.v, state.x
    slip, stuck = mode.slip.copy(), resting.copy()
    for _ in range(len(q)):
        force, _ = _forces(motion, q, v, x, u, dataclasses.replace(mode, slip=slip))
        acceleration = motion.accelerate(q, v, u, force)
        mobility = _mobility(motion, q, v, u, force, acceleration)
        holding = _holding(mobility, acceleration, stuck)
        excess = np.where(stuck, np.abs(holding) / np.where(stuck, limit, 1.0), 0.0)
        worst = excess.argmax(axis=0)
        rows = np.flatnonzero(excess.max(axis=0) > 1.0)
        if not rows.size:
            break
        # Let go one joint at a time: its slipping may relieve the others.
        slip[worst[rows], rows] = -np.sign(holding[worst[rows], rows])
        stuck[worst[rows], rows] = False
    return dataclasses.replace(mode, slip=slip, stuck=stuck)


def _events(motion: Motion, state: State, u: Array, mode: Mode) -> Array:
    """Functions that are positive while the mode lasts, (n_events, n)."""
    found = [
        np.where(mode.slip[j] != 0, mode.slip[j] * state.v[j], 1.0) for j in range(len(state.v))
    ]
    if motion.plays:
        push = motion.drive_force(state.q, state.v, u, motion.parameters)
        for i, (j, play) in enumerate(motion.plays):
            edge = 0.5 * play.width
            found.append(np.where(mode.side[i] != 0, mode.side[i] * push[j], 1.0))
            found.append(np.where(mode.open[i], edge - state.x[i], 1.0))
            found.append(np.where(mode.open[i], edge + state.x[i], 1.0))
    return np.stack(found)


def _between_events(
    motion: Motion, state: State, u: Array, h: Array, mode: Mode, events: int
) -> State:
    after = _step(motion, state, u, h, mode)
    end = _events(motion, after, u[1], mode)
    rows = np.flatnonzero((end < 0).any(axis=0))
    if not rows.size:
        return after
    if events == 0:
        after.v[mode.slip * after.v < 0] = 0.0
        return after
    motion, state, u, h = motion.take(rows), state.take(rows), u[..., rows], h[rows]
    mode, end = mode.take(rows), end[:, rows]
    start = _events(motion, state, u[0], mode)
    # The first event by a straight line, then by a parabola through a state near it.
    line = np.where(end < 0, 0.5, np.inf)
    np.divide(start, start - end, out=line, where=(end < 0) & (start > 0))
    which = line.argmin(axis=0)
    pick = (which, np.arange(rows.size))
    guess = np.clip(line[pick], 1e-3, 1.0)
    until = _until(u, guess)
    near = _events(motion, _step(motion, state, until, guess * h, mode), until[1], mode)[pick]
    share = _parabola_root(start[pick], guess, near, end[pick])
    until = _until(u, share)
    reached = _step(motion, state, until, share * h, mode)
    _make_exact(motion, reached, mode, which)
    rest = np.stack([until[1], u[1]])
    after.put(rows, advance(motion, reached, rest, (1 - share) * h, events - 1))
    return after


def _until(u: Array, share: Array) -> Array:
    """The first part of inputs that run straight, up to a share of the sub-step."""
    return np.stack([u[0], u[0] + share * (u[1] - u[0])])


def _parabola_root(start: Array, guess: Array, near: Array, end: Array) -> Array:
    """Where in (0, 1) the parabola through (0, start), (guess, near), (1, end) turns negative."""
    with np.errstate(divide="ignore", invalid="ignore"):
        rise = (near - start) / guess
        bend = (rise - (end - start)) / (guess - 1)
        slope = rise - bend * guess
        root = np.sqrt(np.maximum(slope * slope - 4 * bend * start, 0.0))
        # Both forms of the quadratic formula, each stable for its sign of the slope.
        falling = 2 * start / (-slope + root)
        rising = (-slope - root) / (2 * bend)
        share = np.where((slope < 0) & (start > 0), falling, rising)
    share = np.where(np.isfinite(share) & (share > 0) & (guess < 1), share, guess)
    return np.clip(share, 1e-9, 1.0)


def _make_exact(motion: Motion, state: State, mode: Mode, which: Rows) -> None:
    """Remove what is left of the located event's function, in place."""
    joints = len(state.v)
    for j in range(joints):
        state.v[j, which == j] = 0.0
    for i, (_, play) in enumerate(motion.plays):
        edge = np.broadcast_to(0.5 * np.asarray(play.width), which.shape)
        letting_go, upper, lower = (which == joints + 3 * i + k for k in range(3))
        # Just off the edge, or the push that is left by rounding would close the play again.
        state.x[i] = np.where(letting_go, mode.side[i] * edge * (1 - 1e-12), state.x[i])
        state.x[i] = np.where(upper, edge, np.where(lower, -edge, state.x[i]))
