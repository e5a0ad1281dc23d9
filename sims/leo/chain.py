"""Leo's bodies, joints, motors and wheels in a Pymunk space: a scratch pad that leaves no trace.

Chipmunk keeps the impulses of the last step to start the next solution from; they can neither
be read nor set. Before each state is set they are therefore driven to zero (``_forget``), so
that what was simulated before does not change a bit.

This is the only file that calls Chipmunk's functions directly: an update of six motors in each
of a hundred sub-steps is too slow through properties.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Sequence

import pymunk
from pymunk._chipmunk_cffi import lib

from sims.leo.body import GROUND, HEEL, PARENT, PIVOT, TOE, WHEEL
from sims.leo.build import Build, links_of

ITERATIONS = 10
# The first sub-step starts from no impulses; unsolved rests of it would let a foot creep.
FIRST_ITERATIONS = 100
SLOP = 2e-5  # m that a wheel may sink before it is pushed out
_FAR = 1e3
_FREE = math.inf
_get_rate = lib.cpBodyGetAngularVelocity
_get_angle = lib.cpBodyGetAngle
_set_rate = lib.cpSimpleMotorSetRate
_set_limit = lib.cpConstraintSetMaxForce

# Joint stops of the robot, hips, knees, ankles, in rad.
STOPS = ((-0.785398, 2.548181), (-2.617994, 0.034907), (-1.570796, 1.448623))


class Chain:
    """Seven bodies, their pivots and motors, and the ground.

    Args:
        stops: Whether the joints have stops.
        dry: Whether dry friction can act on all nine coordinates.
    """

    def __init__(self, stops: bool, dry: bool) -> None:
        space = self._space = pymunk.Space()
        space.iterations = ITERATIONS
        space.collision_slop = SLOP
        space.collision_persistence = 1
        ground = pymunk.Segment(space.static_body, (-50.0, GROUND - 1.0), (50.0, GROUND - 1.0), 1.0)
        ground.friction = 1.0
        space.add(ground)
        self._bodies = [pymunk.Body(1.0, 1.0) for _ in range(7)]
        space.add(*self._bodies)
        self._wheels = [
            pymunk.Circle(self._bodies[foot], WHEEL, wheel)
            for foot in (5, 6)
            for wheel in (HEEL, TOE)
        ]
        for wheel in self._wheels:
            wheel.filter = pymunk.ShapeFilter(group=1)
        space.add(*self._wheels)
        pairs = [(self._bodies[PARENT[i]], self._bodies[i]) for i in range(1, 7)]
        self._pivots: list[pymunk.Constraint] = [
            pymunk.PivotJoint(a, b, PIVOT[i + 1], (0.0, 0.0)) for i, (a, b) in enumerate(pairs)
        ]
        self._stops: list[pymunk.Constraint] = []
        if stops:
            self._stops = [
                pymunk.RotaryLimitJoint(a, b, *STOPS[i // 2]) for i, (a, b) in enumerate(pairs)
            ]
        motors = [pymunk.SimpleMotor(a, b, 0.0) for a, b in pairs]
        brakes = self._brakes(pairs) if dry else []
        holding, pushing = [*self._pivots, *self._stops], [*motors, *brakes]
        for constraint in (*holding, *pushing):
            constraint.collide_bodies = False
        space.add(*holding, *pushing)
        # Handles for the inner loops: what is held always, what pushes with a limited force.
        self._cp_space = space._space
        self._cp_bodies = [body._body for body in self._bodies]
        self._cp_motors = [motor._constraint for motor in motors]
        self._cp_brakes = [brake._constraint for brake in brakes]
        self._cp_holding = [constraint._constraint for constraint in holding]
        self._cp_pushing = [constraint._constraint for constraint in pushing]
        self._build: Build | None = None
        self._h = 0.0
        self._cold = True

    def _brakes(self, pairs: list[tuple[pymunk.Body, pymunk.Body]]) -> list[pymunk.Constraint]:
        """Dry friction on x, z, pitch and the six joints: holds, up to a limited force."""
        ground, torso = self._space.static_body, self._bodies[0]
        long = 10 * _FAR
        along_x = pymunk.GrooveJoint(ground, torso, (0.0, -long), (0.0, long), (0.0, 0.0))
        along_z = pymunk.GrooveJoint(ground, torso, (-long, 0.0), (long, 0.0), (0.0, 0.0))
        for groove in (along_x, along_z):
            groove.error_bias = 1.0  # it brakes, it does not pull back
        turning = [(ground, torso), *pairs]
        return [along_x, along_z, *(pymunk.SimpleMotor(a, b, 0.0) for a, b in turning)]

    def prepare(self, build: Build, h: float) -> None:
        """Give the bodies their masses, and set how errors fade per sub-step of ``h`` seconds."""
        if h != self._h:
            # A fifth of a penetration and half of a joint's error in each sub-step.
            self._space.collision_bias = 0.8 ** (1 / h)
            for pivot in self._pivots:
                pivot.error_bias = 0.5 ** (1 / h)
            # A stop hardly pushes back; without any push Chipmunk would leave it out.
            for stop in self._stops:
                stop.error_bias = 0.999 ** (1 / h)
            self._h = h
        if build == self._build:
            return
        self._build = build
        links = links_of(build)
        self._centres = [link.centre for link, _ in links]
        for body, (link, mass) in zip(self._bodies, links, strict=True):
            body.mass, body.moment = mass, link.inertia
            body.center_of_gravity = link.centre
        for wheel in self._wheels:
            wheel.friction = build.ground_friction
        fall = -build.gravity
        self._space.gravity = fall * math.sin(build.slope), fall * math.cos(build.slope)

    def set(self, q: Sequence[float], v: Sequence[float]) -> None:
        """Put the chain into a state: positions and rates of the nine coordinates."""
        self._forget()
        sin, cos = math.sin, math.cos
        placed: list[tuple[float, float, float, float, float, float]] = []
        for i in range(7):
            if i:
                angle, rate, x, z, vx, vz = placed[PARENT[i]]
                s, c = sin(angle), cos(angle)
                px, pz = PIVOT[i]
                dx, dz = c * px - s * pz, s * px + c * pz
                x, z, vx, vz = x + dx, z + dz, vx - rate * dz, vz + rate * dx
                angle, rate = angle + q[i + 2], rate + v[i + 2]
            else:
                angle, rate, x, z, vx, vz = -q[2], -v[2], q[0], q[1], v[0], v[1]
            placed.append((angle, rate, x, z, vx, vz))
        for body, (px, pz), (angle, rate, x, z, vx, vz) in zip(
            self._cp_bodies, self._centres, placed, strict=True
        ):
            s, c = sin(angle), cos(angle)
            dx, dz = c * px - s * pz, s * px + c * pz
            lib.cpBodySetAngle(body, angle)
            lib.cpBodySetPosition(body, (x, z))
            lib.cpBodySetVelocity(body, (vx - rate * dz, vz + rate * dx))
            lib.cpBodySetAngularVelocity(body, rate)

    def get(self) -> tuple[list[float], list[float]]:
        """Positions and rates of the nine coordinates; what the pivots lack is left out."""
        torso = self._cp_bodies[0]
        angles = [_get_angle(body) for body in self._cp_bodies]
        rates = [_get_rate(body) for body in self._cp_bodies]
        place, speed = lib.cpBodyGetPosition(torso), lib.cpBodyGetVelocity(torso)
        s, c = math.sin(angles[0]), math.cos(angles[0])
        px, pz = self._centres[0]
        dx, dz = c * px - s * pz, s * px + c * pz
        q = [place.x, place.y, -angles[0]]
        v = [speed.x + rates[0] * dz, speed.y - rates[0] * dx, -rates[0]]
        for i in range(1, 7):
            q.append(angles[i] - angles[PARENT[i]])
            v.append(rates[i] - rates[PARENT[i]])
        return q, v

    def _forget(self) -> None:
        """Bring every cached impulse to zero: no limit, no contact, three steps."""
        for constraint in self._cp_pushing:
            _set_limit(constraint, 0.0)
        for constraint in self._cp_holding:
            _set_limit(constraint, 0.0)
        for i, body in enumerate(self._cp_bodies):
            lib.cpBodySetPosition(body, (10.0 * i, _FAR))
        for _ in range(3):
            lib.cpSpaceStep(self._cp_space, self._h)
        for constraint in self._cp_holding:
            _set_limit(constraint, _FREE)
        self._cold = True

    def run(
        self,
        targets: Sequence[float],
        slopes: Sequence[float],
        steps: int,
        further: Callable[[], None] | None = None,
    ) -> None:
        """Sub-steps in which each motor pulls with slope (target - rate) N m.

        A motor in Chipmunk holds a rate with a limited torque. With the torque of the motor law
        as its limit and the rate at which that law gives none as its target it cannot overshoot,
        which an explicit torque does on the light feet.

        Args:
            targets: rad/s, one for each of the six joints.
            slopes: N m s/rad, likewise.
            steps: Number of sub-steps.
            further: Called in every sub-step before it is solved, to ``push`` and ``brake``.
        """
        for motor, target in zip(self._cp_motors, targets, strict=True):
            _set_rate(motor, -target)
        if self._cold:
            self._cold = False
            self._space.iterations = FIRST_ITERATIONS
            self._substeps(targets, slopes, 1, further)
            self._space.iterations = ITERATIONS
            steps -= 1
        self._substeps(targets, slopes, steps, further)

    def _substeps(
        self,
        targets: Sequence[float],
        slopes: Sequence[float],
        steps: int,
        further: Callable[[], None] | None,
    ) -> None:
        step, space, h = lib.cpSpaceStep, self._cp_space, self._h
        torso, b1, b2, b3, b4, b5, b6 = self._cp_bodies
        m1, m2, m3, m4, m5, m6 = self._cp_motors
        t1, t2, t3, t4, t5, t6 = targets
        s1, s2, s3, s4, s5, s6 = slopes
        for _ in range(steps):
            w0, w1, w2 = _get_rate(torso), _get_rate(b1), _get_rate(b2)
            w3, w4 = _get_rate(b3), _get_rate(b4)
            _set_limit(m1, s1 * abs(t1 - w1 + w0))
            _set_limit(m2, s2 * abs(t2 - w2 + w0))
            _set_limit(m3, s3 * abs(t3 - w3 + w1))
            _set_limit(m4, s4 * abs(t4 - w4 + w2))
            _set_limit(m5, s5 * abs(t5 - _get_rate(b5) + w3))
            _set_limit(m6, s6 * abs(t6 - _get_rate(b6) + w4))
            if further is not None:
                further()
            step(space, h)

    # -- for forces that the motor law does not cover -------------------------------------

    def joint(self, j: int) -> tuple[float, float]:
        """Position and rate of one of the nine coordinates, within a run."""
        if j < 2:
            q, v = self.get()
            return q[j], v[j]
        body = self._cp_bodies[max(j - 2, 0)]
        if j == 2:
            return -_get_angle(body), -_get_rate(body)
        carrier = self._cp_bodies[PARENT[j - 2]]
        return _get_angle(body) - _get_angle(carrier), _get_rate(body) - _get_rate(carrier)

    def push(self, j: int, rate: float, torque: float, slope: float) -> None:
        """Let motor ``j`` pull with a torque that falls by ``slope`` per rate beyond ``rate``."""
        motor = self._cp_motors[j]
        _set_rate(motor, -(rate + torque / slope))
        _set_limit(motor, abs(torque))

    def brake(self, j: int, limit: float) -> None:
        """Dry friction of a size on one of the nine coordinates, in this run from now on."""
        _set_limit(self._cp_brakes[j], limit)

    def load(self, force: Sequence[float]) -> None:
        """Forces on x and z at the torso's origin and torque on the pitch, for one sub-step."""
        torso = self._cp_bodies[0]
        angle = _get_angle(torso)
        s, c = math.sin(angle), math.cos(angle)
        px, pz = self._centres[0]
        dx, dz = c * px - s * pz, s * px + c * pz
        fx, fz, pitch = force
        lib.cpBodySetForce(torso, (fx, fz))
        lib.cpBodySetTorque(torso, dz * fx - dx * fz - pitch)


_scratch = threading.local()


def chain(stops: bool, dry: bool) -> Chain:
    """The chain of this thread: every Leo may use it, since it keeps nothing."""
    known: dict[tuple[bool, bool], Chain] = _scratch.__dict__.setdefault("chains", {})
    if (stops, dry) not in known:
        known[stops, dry] = Chain(stops, dry)
    return known[stops, dry]
