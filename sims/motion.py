"""What moves in a batch of rows: accelerations, and the forces that are added to them.

Joints first and rows last, (n_joints, n), as in ``sims.rows``.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from types import SimpleNamespace

import numpy as np

from sims.effects.backlash import Backlash
from sims.effects.coupling import Coupling
from sims.effects.exchange import BetweenStates
from sims.effects.flexible import FlexiblePart
from sims.effects.friction import CoulombFriction, DryFriction
from sims.effects.joint import JointEffect
from sims.effects.limit import RateLimit
from sims.effects.link import Link
from sims.effects.response import AsymmetricResponse
from sims.effects.store import SecondStore
from sims.rows import Mask, Rows, State
from sims.simulator import Array
from sims.values import Values

Acceleration = Callable[[Array, Array, Array, Array, SimpleNamespace], Array]
DriveForce = Callable[[Array, Array, Array, SimpleNamespace], Array]
Flow = BetweenStates | SecondStore | Coupling | Link


@dataclasses.dataclass(frozen=True)
class Motion:
    """What moves.

    Args:
        acceleration: (q, v, u, force, parameters) -> accelerations; all (n_joints, n) but
            u (n_a, n). Linear in the force.
        drive_force: (q, v, u, parameters) -> (n_joints, n), for plays and friction of the drive.
        parameters: Each a scalar or (n,).
        smooth, dry, plays, capped: Effects with the number of the joint they act on.
        returns: The same, and whether the state is a speed.
        flows: The same with the numbers of both joints or states that something acts between.
        parts: The same with the number of the joint and the part's own, after all joints.
        span: Time in s, by row, in which a rate comes back to its limit; None of a first-order
            system, whose limit is of what ``acceleration`` tells.
    """

    acceleration: Acceleration
    drive_force: DriveForce
    parameters: SimpleNamespace
    smooth: tuple[tuple[int, JointEffect], ...] = ()
    dry: tuple[tuple[int, DryFriction], ...] = ()
    plays: tuple[tuple[int, Backlash], ...] = ()
    capped: tuple[tuple[int, RateLimit], ...] = ()
    returns: tuple[tuple[int, AsymmetricResponse, bool], ...] = ()
    flows: tuple[tuple[int, int, Flow], ...] = ()
    parts: tuple[tuple[int, int, FlexiblePart], ...] = ()
    span: Array | None = None

    def take(self, rows: Rows) -> Motion:
        """The same for some rows."""
        return Motion(
            self.acceleration,
            self.drive_force,
            _some(self.parameters, rows),
            tuple((j, effect.take(rows)) for j, effect in self.smooth),
            tuple((j, effect.take(rows)) for j, effect in self.dry),
            tuple((j, effect.take(rows)) for j, effect in self.plays),
            tuple((j, effect.take(rows)) for j, effect in self.capped),
            tuple((j, effect.take(rows), speed) for j, effect, speed in self.returns),
            tuple((i, j, effect.take(rows)) for i, j, effect in self.flows),
            tuple((j, i, effect.take(rows)) for j, i, effect in self.parts),
            None if self.span is None else self.span[rows],
        )

    @property
    def by_force(self) -> bool:
        """Whether a force on a joint is an acceleration of that joint, and of no other."""
        return self.span is None and not self.parts

    @property
    def even(self) -> bool:
        """Whether dry friction is of the same size at every rate."""
        return all(isinstance(effect, CoulombFriction) for _, effect in self.dry)

    def load(self, q: Array, v: Array, force: Array | None = None) -> Array:
        """Force of the smooth effects on every joint, what flows between them, a further force."""
        total = np.zeros(q.shape) if force is None else force
        for j, effect in self.smooth:
            total[j] += effect.force(q[j], v[j])
        for i, j, flow in self.flows:
            inward, outward = flow.flows((q[i], q[j]), (v[i], v[j]))
            total[i] += inward
            total[j] += outward
        return total

    def accelerate(self, q: Array, v: Array, u: Array, load: Array) -> Array:
        """Accelerations under a force on every joint."""
        return self._accelerate(q, v, u, load, self.parameters, self.parts)

    def _accelerate(
        self, q: Array, v: Array, u: Array, load: Array, parameters: SimpleNamespace,
        parts: Sequence[tuple[int, int, FlexiblePart]],
    ) -> Array:  # fmt: skip
        if not parts:
            return self.acceleration(q, v, u, load, parameters)
        own, found = len(q) - len(parts), np.empty_like(v)
        q, parted = q[:own], q[own:]
        found[:own] = self.acceleration(q, v[:own], u, load[:own], parameters)
        rest = np.zeros_like(q), np.zeros_like(u), np.zeros_like(q)
        # What pulls by position pulls at the part where that is; a speed has no position.
        here = self.acceleration(q, *rest, parameters) if self.span is not None else 0.0 * q
        for (j, i, part), beside in zip(parts, parted, strict=True):
            there, falls = q, here
            if self.span is not None:
                there = q.copy()
                there[j] += beside
                falls = self.acceleration(there, *rest, parameters)
            pull, carried = part.pull(beside, v[i]), part.carried
            found[j] += part.ratio * (found[j] + pull - carried * here[j])
            found[i] = carried * falls[j] - pull - found[j]
        return found

    def cap(self, v: Array, acceleration: Array) -> Array:
        """The accelerations, which are changed, with states that go back at a pace of their own and
        rates kept within their limits."""
        for j, response, speed in self.returns:
            acceleration[j] = response.changed(v[j], acceleration[j], speed)
        for j, effect in self.capped:
            if self.span is None:
                acceleration[j] = effect.cut_change(acceleration[j])
            else:
                acceleration[j] = effect.cut(v[j], acceleration[j], self.span)
        return acceleration

    def mobility(
        self,
        q: Array,
        v: Array,
        u: Array,
        load: Array,
        acceleration: Array,
        asked: Mask,
        rows: Rows,
    ) -> Array:
        """Acceleration of joint i per unit force on joint j, as [j, i, row].

        Args:
            q, v, u, load: As for ``accelerate``.
            acceleration: Which that returned.
            asked: (n_joints, n), for which joints j; for the others it is zero.
            rows: In which rows.
        """
        joints = len(q)
        found = np.zeros((joints, joints, rows.size))
        if self.by_force:
            found[range(joints), range(joints)] = asked[:, rows]
            return found
        # One call for all joints.
        places = [np.flatnonzero(asked[j, rows]) for j in range(joints)]
        index = rows[np.concatenate(places)]
        more = load.take(index, 1)
        ends = np.cumsum([place.size for place in places]).tolist()
        for j, (start, end) in enumerate(zip([0, *ends[:-1]], ends, strict=True)):
            more[j, start:end] += 1.0
        change = self._accelerate(
            q.take(index, 1), v.take(index, 1), u.take(index, 1), more,
            _some(self.parameters, index), [(j, i, part.take(index)) for j, i, part in self.parts],
        ) - acceleration.take(index, 1)  # fmt: skip
        for j, (start, end) in enumerate(zip([0, *ends[:-1]], ends, strict=True)):
            found[j][:, places[j]] = change[:, start:end]
        return found

    def drive(self, q: Array, v: Array, u: Array) -> Array:
        """Force of the actuators on every joint."""
        if not self.parts:
            return self.drive_force(q, v, u, self.parameters)
        own, push = len(q) - len(self.parts), np.zeros(q.shape)
        push[:own] = self.drive_force(q[:own], v[:own], u, self.parameters)
        return push

    def drive_and_free(self, q: Array, v: Array, u: Array) -> tuple[Array, Array]:
        """The same, and each drive's free speed across its play, (n_plays, n)."""
        push = self.drive(q, v, u)
        free = np.zeros((len(self.plays), q.shape[1]))
        for i, (j, _) in enumerate(self.plays):
            faster = v.copy()
            faster[j] += 1.0
            free[i] = push[j] / (push[j] - self.drive(q, faster, u)[j])
        return push, free

    @property
    def rubs_by_drive(self) -> bool:
        """Whether the size of dry friction depends on the force of the actuators."""
        return any(effect.follows_drive for _, effect in self.dry)

    def limits(self, q: Array, v: Array, u: Array) -> Array:
        """Size of the dry friction on every joint."""
        size = np.zeros(v.shape)
        push = self.drive(q, v, u) if self.rubs_by_drive else size
        for j, effect in self.dry:
            size[j] += effect.under(push[j]).limit(np.abs(v[j]))
        return size


def advance_smoothly(motion: Motion, state: State, u: Array, h: Array) -> State:
    """State after ``h`` seconds, (n,), under inputs ``u`` (2, n_a, n), without friction and play.

    One classical fourth-order step of Runge and Kutta.
    """

    def accelerations(q: Array, v: Array, u: Array) -> Array:
        return motion.cap(v, motion.accelerate(q, v, u, motion.load(q, v)))

    q, v, x = state
    middle, half = 0.5 * (u[0] + u[1]), 0.5 * h
    a1 = accelerations(q, v, u[0])
    v2 = v + half * a1
    a2 = accelerations(q + half * v, v2, middle)
    v3 = v + half * a2
    a3 = accelerations(q + half * v2, v3, middle)
    v4 = v + h * a3
    a4 = accelerations(q + h * v3, v4, u[1])
    sixth = h / 6
    return State(q + sixth * (v + 2 * (v2 + v3) + v4), v + sixth * (a1 + 2 * (a2 + a3) + a4), x)


def substep_ends(inputs: Array) -> Array:
    """Values at both ends of every sub-step, (substeps, 2, n_a, n), rows contiguous."""
    if inputs.ndim == 3:
        ends = np.stack([inputs, inputs])
    else:
        mean, rise = inputs[..., 0], inputs[..., 1]
        ends = np.stack([mean - 0.5 * rise, mean + 0.5 * rise])
    return np.ascontiguousarray(ends.transpose(2, 0, 3, 1))


def _some(parameters: SimpleNamespace, rows: Rows) -> SimpleNamespace:
    return Values(**{name: p[rows] if np.ndim(p) else p for name, p in vars(parameters).items()})
