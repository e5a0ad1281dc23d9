"""The links of Leo: masses, where the joints are, and where everything is in a given state.

Figures: the authors' rigid-body model of Leo. x points forward, z up; every link has a frame at
its proximal joint (the torso at its centre), whose angle is counted from upright, positive
counter-clockwise when walking to the right. So the torso's angle is minus its pitch, a positive
hip swings the thigh forward, a negative knee is flexed, a positive ankle lifts the toe.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from sims.simulator import Array

Point = tuple[float, float]


@dataclasses.dataclass(frozen=True)
class Link:
    """A rigid link: mass in kg, centre of mass in its frame in m, inertia about it in kg m^2."""

    mass: float
    centre: Point
    inertia: float


TORSO = Link(0.94226, (-0.00102, 0.009945), 4.676374e-3)
ARM = Link(0.095, (0.05308, -0.14260), 8.7318718e-4)
THIGH = Link(0.19978, (0.00285, -0.06281), 2.73133e-4)
SHANK = Link(0.13691, (0.01209, -0.06292), 1.53379e-4)
FOOT = Link(0.07319, (0.00948, -0.03098), 4.8812e-5)

SHOULDER: Point = (-0.00543, 0.091275)
HAND: Point = (0.1173, -0.26947)
HIP: Point = (0.00273, -0.120775)
KNEE: Point = (0.0, -0.116)
ANKLE: Point = (0.00405, -0.1085)
HEEL: Point = (-0.0315, -0.03559)
TOE: Point = (0.0495, -0.03559)
WHEEL = 0.013
"""Radius in m of the wheels on which heel and toe stand."""

GEAR = 212.6
"""Turns of a motor per turn of its joint."""

GROUND = HIP[1] + KNEE[1] + ANKLE[1] + HEEL[1] - WHEEL
"""Height of the ground where the torso's start height, on straight legs, is z = 0."""

MOTORS = ("left_hip", "right_hip", "left_knee", "right_knee", "left_ankle", "right_ankle")
"""The driven joints, in the order of states and actions."""
COORDINATES = ("x", "z", "pitch", *MOTORS)
"""What the state counts: place and pitch of the torso, then the joints."""

LINKS = (
    "torso",
    "left thigh",
    "right thigh",
    "left shank",
    "right shank",
    "left foot",
    "right foot",
)
PARENT = (-1, 0, 0, 1, 2, 3, 4)
"""For each link, the link that carries it."""
PIVOT: tuple[Point, ...] = ((0.0, 0.0), HIP, HIP, KNEE, KNEE, ANKLE, ANKLE)
"""For each link, the origin of its frame in its parent's."""


def torso_with_load(
    torso_mass: float, torso_inertia: float, arm_mass: float, boom_mass: float
) -> Link:
    """Torso with the arm welded to it and the mass of the boom carried at the hip."""
    arm = (SHOULDER[0] + ARM.centre[0], SHOULDER[1] + ARM.centre[1])
    parts = (
        (torso_mass, TORSO.centre, torso_inertia),
        (arm_mass, arm, ARM.inertia),
        (boom_mass, HIP, 0.0),
    )
    mass = torso_mass + arm_mass + boom_mass
    x = sum(m * c[0] for m, c, _ in parts) / mass
    z = sum(m * c[1] for m, c, _ in parts) / mass
    inertia = sum(i + m * ((c[0] - x) ** 2 + (c[1] - z) ** 2) for m, c, i in parts)
    return Link(mass, (x, z), inertia)


def frames(positions: Array) -> tuple[Array, Array]:
    """Angle and origin of every link's frame.

    Args:
        positions: shape (n, 9): x, z, pitch, hips, knees, ankles, left before right.

    Returns:
        Angles in rad, shape (n, 7), and origins in m, shape (n, 7, 2), in the order ``LINKS``.
    """
    angles = np.empty((len(positions), 7))
    origins = np.empty((len(positions), 7, 2))
    angles[:, 0] = -positions[:, 2]
    origins[:, 0] = positions[:, :2]
    for link in range(1, 7):
        parent = PARENT[link]
        angles[:, link] = angles[:, parent] + positions[:, link + 2]
        origins[:, link] = origins[:, parent] + turned(angles[:, parent], PIVOT[link])
    return angles, origins


def turned(angles: Array, point: Point) -> Array:
    """A link's point relative to its origin in the world: shape (n,) to (n, 2)."""
    sine, cosine = np.sin(angles), np.cos(angles)
    return np.stack(
        [cosine * point[0] - sine * point[1], sine * point[0] + cosine * point[1]], axis=1
    )


def centre_of_mass(positions: Array) -> Array:
    """Centre of mass of the idealised Leo as a whole in m, (n, 9) to (n, 2)."""
    swing = np.stack([-positions[:, 2], *positions[:, 3:9].T])
    swing[1:3] += swing[0]
    swing[3:5] += swing[1:3]
    swing[5:7] += swing[3:5]
    sine, cosine = np.sin(swing), np.cos(swing)
    x, z = _LEVERS[:, :1], _LEVERS[:, 1:]
    ahead = (cosine * x - sine * z).sum(axis=0)
    up = (sine * x + cosine * z).sum(axis=0)
    return positions[:, :2] + np.stack([ahead, up], axis=1)


def _levers() -> Array:
    """How far each link's turning moves the centre of mass, in the link's frame, (7, 2)."""
    torso = torso_with_load(TORSO.mass, TORSO.inertia, ARM.mass, 0.0)
    links = (torso, THIGH, THIGH, SHANK, SHANK, FOOT, FOOT)
    moment = np.array([np.multiply(link.mass, link.centre) for link in links])
    carried = [link.mass for link in links]
    for link in range(6, 0, -1):
        moment[PARENT[link]] += np.multiply(carried[link], PIVOT[link])
        carried[PARENT[link]] += carried[link]
    return moment / carried[0]


_LEVERS = _levers()


def clearance(positions: Array) -> Array:
    """Height in m of the four wheels above the ground, (n, 9) to (n, 4).

    Order: left heel, left toe, right heel, right toe; below zero they are in the ground.
    """
    angles, origins = frames(positions)
    return np.stack(
        [
            origins[:, foot, 1] + turned(angles[:, foot], point)[:, 1] - WHEEL - GROUND
            for foot in (5, 6)
            for point in (HEEL, TOE)
        ],
        axis=1,
    )
