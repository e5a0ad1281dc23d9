"""Leo once more, in generalized coordinates: independent of Pymunk and of ``sims``.

Coordinates u = (x, z, absolute angles of the seven links). Every point of the robot is (x, z)
plus constant levers turned by those angles, which gives the mass matrix in closed form. Rates
are advanced with the motors' damping at the mean rate (implicit midpoint), positions half a
step apart (leapfrog). The contacts of the four wheels - rigid, inelastic, with Coulomb friction -
are solved as exact 2x2 problems, one by one until all agree. All rows of a batch at once.

Figures: the authors' rigid-body model.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
from contact_impulses import finished, one_contact

HIP, KNEE, ANKLE = (0.00273, -0.120775), (0.0, -0.116), (0.00405, -0.1085)
SHOULDER = (-0.00543, 0.091275)
HEEL, TOE, RADIUS = (-0.0315, -0.03559), (0.0495, -0.03559), 0.013
GROUND = -0.393865
STOPS = np.repeat([(-0.785398, 2.548181), (-2.617994, 0.034907), (-1.570796, 1.448623)], 2, axis=0)

# Absolute angles of torso, thighs, shanks and feet from (pitch, hips, knees, ankles).
TURNS = np.array(
    [
        [-1, 0, 0, 0, 0, 0, 0],
        [-1, 1, 0, 0, 0, 0, 0],
        [-1, 0, 1, 0, 0, 0, 0],
        [-1, 1, 0, 1, 0, 0, 0],
        [-1, 0, 1, 0, 1, 0, 0],
        [-1, 1, 0, 1, 0, 1, 0],
        [-1, 0, 1, 0, 1, 0, 1],
    ],
    float,
)
TO_ABSOLUTE = np.eye(9)
TO_ABSOLUTE[2:, 2:] = TURNS
TO_POSE = np.linalg.inv(TO_ABSOLUTE)
JOINTS = TO_POSE[3:]
"""Rates of the six joints from those of the coordinates."""


def _levers(link, place):
    """For a point of a link, its levers (7, 2) in the frames of all links."""
    found = np.zeros((7, 2))
    found[link] = place
    while link > 0:
        carrier = (None, 0, 0, 1, 2, 3, 4)[link]
        found[carrier] = (HIP, HIP, KNEE, KNEE, ANKLE, ANKLE)[link - 1]
        link = carrier
    return found


WHEELS = np.stack([_levers(foot, place) for foot in (5, 6) for place in (HEEL, TOE)])
WHEEL_FOOT = (5, 5, 6, 6)


@dataclasses.dataclass(frozen=True)
class System:
    """Parameters in SI units, by default of the idealised Leo; scalars or one value per row.

    Args:
        friction: Viscous, of all joints, or shape (6,).
        force: Further generalized force (q, v) -> (n, 9) on the coordinates of the state.
        stops: Whether joints have stops.
    """

    torso_mass: float = 0.94226
    torso_inertia: float = 4.676374e-3
    arm_mass: float = 0.095
    thigh_mass: float = 0.19978
    shank_mass: float = 0.13691
    foot_mass: float = 0.07319
    boom_mass: float = 0.0
    gravity: float = 9.81
    slope: float = 0.0
    ground_friction: float = 10.0
    torque_constant: float = 0.006325081 * 212.6
    resistance: float = 4.6
    supply: float = 1.0
    friction: float | np.ndarray = 0.0
    force: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None
    stops: bool = False


TRUE = System(torso_mass=1.25, friction=0.03)


class _Body:
    """Mass matrix and forces of a system, for n rows."""

    def __init__(self, s: System, n: int) -> None:
        def rows(value):
            return np.broadcast_to(np.asarray(value, float), (n,))

        arm = (SHOULDER[0] + 0.05308, SHOULDER[1] - 0.14260)
        thigh, shank, foot = (0.00285, -0.06281), (0.01209, -0.06292), (0.00948, -0.03098)
        parts = [
            (s.torso_mass, s.torso_inertia, _levers(0, (-0.00102, 0.009945))),
            (s.arm_mass, 8.7318718e-4, _levers(0, arm)),
            (s.boom_mass, 0.0, _levers(0, HIP)),
            *((s.thigh_mass, 2.73133e-4, _levers(link, thigh)) for link in (1, 2)),
            *((s.shank_mass, 1.53379e-4, _levers(link, shank)) for link in (3, 4)),
            *((s.foot_mass, 4.8812e-5, _levers(link, foot)) for link in (5, 6)),
        ]
        links = (0, 0, 0, 1, 2, 3, 4, 5, 6)
        self.mass = sum(rows(m) for m, _, _ in parts)
        self.first = sum(rows(m)[:, None, None] * lever for m, _, lever in parts)
        # Sums over the masses of dot and cross products of their levers.
        dots = [lever @ lever.T for _, _, lever in parts]
        crosses = [np.outer(x := lv[:, 0], z := lv[:, 1]) - np.outer(z, x) for _, _, lv in parts]
        masses = [rows(m)[:, None, None] for m, _, _ in parts]
        self.dot = sum(m * d for m, d in zip(masses, dots, strict=True))
        self.cross = sum(m * c for m, c in zip(masses, crosses, strict=True))
        self.inertia = np.zeros((n, 7, 7))
        for link, (_, inertia, _) in zip(links, parts, strict=True):
            self.inertia[:, link, link] += rows(inertia)
        g, tilt = rows(s.gravity), rows(s.slope)
        self.weight = np.stack([-g * np.sin(tilt), -g * np.cos(tilt)], axis=1)
        k, r = rows(s.torque_constant)[:, None], rows(s.resistance)[:, None]
        friction = np.asarray(s.friction, float)
        friction = friction[:, None] if friction.shape == (n,) else friction
        self.drive = k / r * rows(s.supply)[:, None]
        self.damping = np.broadcast_to(k * k / r + friction, (n, 6))
        self.spread = np.einsum("nj,ji,jk->nik", self.damping, JOINTS, JOINTS)
        self.friction_of_ground = rows(s.ground_friction)

    def mechanics(self, u, w):
        """Mass matrix (n, 9, 9) and force of gravity and centripetal terms (n, 9)."""
        phi, rates = u[:, 2:], w[:, 2:]
        c, s = np.cos(phi), np.sin(phi)
        cosine = c[:, :, None] * c[:, None] + s[:, :, None] * s[:, None]
        sine = c[:, :, None] * s[:, None] - s[:, :, None] * c[:, None]  # of phi_j - phi_i
        across = _across(c, s, self.first)
        mass = np.empty((len(u), 9, 9))
        mass[:, :2, :2] = self.mass[:, None, None] * np.eye(2)
        mass[:, :2, 2:] = across.transpose(0, 2, 1)
        mass[:, 2:, :2] = across
        mass[:, 2:, 2:] = cosine * self.dot - sine * self.cross + self.inertia
        force = np.empty((len(u), 9))
        square = rates * rates
        along = np.stack([across[..., 1], -across[..., 0]], axis=-1)
        force[:, :2] = self.mass[:, None] * self.weight + np.einsum("nik,ni->nk", along, square)
        force[:, 2:] = np.einsum("nik,nk->ni", across, self.weight)
        force[:, 2:] += np.einsum("nij,nj->ni", cosine * self.cross + sine * self.dot, square)
        return mass, force


def _across(c, s, levers):
    """Levers turned by the angles of their links and by 90 degrees more."""
    x, z = levers[..., 0], levers[..., 1]
    return np.stack([-s * x - c * z, c * x - s * z], axis=-1)


def accelerate(system, u, w, volts):
    """Accelerations of the coordinates without contacts, (n, 9)."""
    body = _Body(system, len(u))
    mass, force = body.mechanics(u, w)
    force += (body.drive * volts - body.damping * (w @ JOINTS.T)) @ JOINTS
    return np.linalg.solve(mass, force[..., None])[..., 0]


def energy(states, system=None):
    """Kinetic and potential energy in J, (n,)."""
    states = np.asarray(states, float)
    u, w = states[:, :9] @ TO_ABSOLUTE.T, states[:, 9:18] @ TO_ABSOLUTE.T
    body = _Body(system or System(), len(u))
    mass, _ = body.mechanics(u, w)
    c, s = np.cos(u[:, 2:]), np.sin(u[:, 2:])
    turned = _across(c, s, np.stack([body.first[..., 1], -body.first[..., 0]], axis=-1))
    centre = u[:, :2] * body.mass[:, None] + turned.sum(axis=1)
    height = -np.einsum("nk,nk->n", centre, body.weight)
    return 0.5 * np.einsum("ni,nij,nj->n", w, mass, w) + height


def step(states, voltages, system=None, h=1e-4, dt=0.03):
    """States (n, 18) after one control period under voltages (n, 6)."""
    system = system or System()
    states, voltages = np.asarray(states, float), np.asarray(voltages, float)
    n, steps = len(states), round(dt / h)
    body = _Body(system, n)
    contacts = _Contacts(system, n, h)
    w = states[:, 9:18] @ TO_ABSOLUTE.T
    u = states[:, :9] @ TO_ABSOLUTE.T + 0.5 * h * w
    push = (body.drive * voltages) @ JOINTS
    half = 0.5 * h * body.spread
    for i in range(steps):
        mass, force = body.mechanics(u, w)
        force += push
        if system.force is not None:
            force += system.force(u @ TO_POSE.T, w @ TO_POSE.T) @ TO_POSE
        left = mass + half
        right = np.einsum("nij,nj->ni", mass - half, w) + h * force
        w = np.linalg.solve(left, right[..., None])[..., 0]
        w = contacts.resolve(body, u, w, left)
        u = u + (h if i < steps - 1 else 0.5 * h) * w
    return np.concatenate([u @ TO_POSE.T, w @ TO_POSE.T], axis=1)


def gaps(states):
    """Heights of the wheels above the ground in m, (n, 4): left heel and toe, then right."""
    return _wheels(np.asarray(states, float)[:, :9] @ TO_ABSOLUTE.T)[0]


def _wheels(u):
    """Heights (n, 4), and Jacobians (n, 4, 2, 9) of the points that touch: along x, along z."""
    c, s = np.cos(u[:, None, 2:]), np.sin(u[:, None, 2:])
    jacobians = np.zeros((len(u), 4, 2, 9))
    across = _across(c, s, WHEELS)
    jacobians[:, :, 0, 0] = jacobians[:, :, 1, 1] = 1.0
    jacobians[..., 2:] = across.transpose(0, 1, 3, 2)
    for wheel, foot in enumerate(WHEEL_FOOT):
        jacobians[:, wheel, 0, 2 + foot] += RADIUS
    # Turned back by 90 degrees, what lies across gives the height.
    height = u[:, 1, None] - across[..., 0].sum(axis=2)
    return height - RADIUS - GROUND, jacobians


class _Contacts:
    """Impulses of wheels and stops; each step starts from those of the step before."""

    def __init__(self, system: System, n: int, h: float, sweeps: int = 60) -> None:
        self.h, self.sweeps, self.stops = h, sweeps, system.stops
        self.impulse = np.zeros((n, 4, 2))
        self.stopping = np.zeros((n, 6))

    def resolve(self, body: _Body, u, w, left):
        height, jacobians = _wheels(u)
        # A wheel above the ground may come down to it within the step, and no further.
        least = -np.maximum(height, 0.0) / self.h
        free = np.einsum("nci,ni->nc", jacobians[:, :, 1], w)
        touching = (free < least).any(axis=1) | (self.impulse[..., 1] > 0).any(axis=1)
        low = high = None
        if self.stops:
            angle, rate = u @ JOINTS.T, w @ JOINTS.T
            low = np.minimum((STOPS[:, 0] - angle) / self.h, 0.0)
            high = np.maximum((STOPS[:, 1] - angle) / self.h, 0.0)
            touching |= ((rate < low) | (rate > high)).any(axis=1)
        rows = np.flatnonzero(touching)
        self.impulse[~touching] = 0.0
        self.stopping[~touching] = 0.0
        if rows.size:
            w = w.copy()
            stop = (low[rows], high[rows]) if self.stops else None
            mu = body.friction_of_ground[rows]
            w[rows] = self._solve(rows, w[rows], left[rows], jacobians[rows], least[rows], mu, stop)
        return w

    def _solve(self, rows, w, left, jacobians, least, mu, stop):
        n = len(rows)
        all_rows = jacobians.reshape(n, 8, 9)
        if stop is not None:
            all_rows = np.concatenate([all_rows, np.broadcast_to(JOINTS, (n, 6, 9))], axis=1)
        response = np.linalg.solve(left, all_rows.transpose(0, 2, 1))
        delassus = all_rows @ response
        impulse = self.impulse[rows].reshape(n, 8)
        stopping = self.stopping[rows]
        both = np.concatenate([impulse, stopping], axis=1)[:, : delassus.shape[1]]
        free = np.einsum("nki,ni->nk", all_rows, w)
        rate = free + np.einsum("nkl,nl->nk", delassus, both)
        for sweep in range(self.sweeps):
            if sweep in (0, 1, 3, 6, 12, 25, 50):
                guess, found = finished(delassus, free, both, least, mu, stop)
                if found.all():
                    both = guess
                    break
            before = rate.copy()
            for c in range(4):
                pair = slice(2 * c, 2 * c + 2)
                a = delassus[:, pair, pair]
                without = rate[:, pair] - np.einsum("nkl,nl->nk", a, both[:, pair])
                new = one_contact(a, without, least[:, c], mu)
                rate += np.einsum("nkl,nl->nk", delassus[:, :, pair], new - both[:, pair])
                both[:, pair] = new
            for j in range(8, delassus.shape[1]):
                a = delassus[:, j, j]
                without = rate[:, j] - a * both[:, j]
                low, high = stop[0][:, j - 8], stop[1][:, j - 8]
                new = (np.clip(without, low, high) - without) / a
                rate += delassus[:, :, j] * (new - both[:, j])[:, None]
                both[:, j] = new
            if np.abs(rate - before).max() < 1e-9:
                break
        else:
            both = np.where(found[:, None], guess, both)
        self.impulse[rows] = both[:, :8].reshape(n, 4, 2)
        if stop is not None:
            self.stopping[rows] = both[:, 8:]
        return w + np.einsum("nik,nk->ni", response, both)
