"""Point masses at places of a model, as a gripper carries them: mass, its centre, and inertia."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from sims.mujoco import elements
from sims.simulator import Array

#: Fields of ``mujoco.MjModel`` that a mass on a body changes.
FIELDS = ("body_mass", "body_ipos", "body_iquat", "body_inertia")
#: Part of a link's length within which a site stands for its tip.
AT_TIP = 0.2


@dataclasses.dataclass(frozen=True)
class Place:
    """Where something may hang.

    Args:
        name: ``"site gripper"`` or ``"tip of body fore"``.
        body: Index of the body that carries it.
        position: In the body's frame, in m.
    """

    name: str
    body: int
    position: tuple[float, float, float]


def places(model: Any) -> list[Place]:
    """Sites of the last links of every chain, and their tips where no site is."""
    found = []
    for b in _last(model):
        sites = [s for s in range(model.nsite) if int(model.site_bodyid[s]) == b]
        found += [_place(f"site {elements.name_of('site', model, s)}", b, model.site_pos[s])
                  for s in sites]  # fmt: skip
        tip, start = _tip(model, b), _anchor(model, b)
        length = np.linalg.norm(tip - start)
        near = any(np.linalg.norm(model.site_pos[s] - tip) < AT_TIP * length for s in sites)
        if length > 0 and not near:
            found.append(_place(f"tip of body {elements.name_of('body', model, b)}", b, tip))
    return found


def load(fields: dict[str, Array], place: Place, mass: Array) -> None:
    """Add a point mass to a body, by the theorem of parallel axes.

    Rows without one keep their bits.

    Args:
        fields: ``FIELDS`` with an entry per row, changed in place.
        place: Where it is.
        mass: In kg, (rows,).
    """
    rows, b = np.flatnonzero(mass), place.body
    own, added = fields["body_mass"][rows, b], mass[rows]
    centre = fields["body_ipos"][rows, b]
    whole = own + added
    fresh = (own[:, None] * centre + added[:, None] * place.position) / whole[:, None]
    axes = Rotation.from_quat(fields["body_iquat"][rows, b], scalar_first=True).as_matrix()
    inertia = (axes * fields["body_inertia"][rows, b, None, :]) @ axes.transpose(0, 2, 1)
    inertia += _about(own, centre - fresh) + _about(added, place.position - fresh)
    moments, turned = np.linalg.eigh(inertia)
    turned[:, :, 0] *= np.sign(np.linalg.det(turned))[:, None]
    fields["body_mass"][rows, b] = whole
    fields["body_ipos"][rows, b] = fresh
    fields["body_iquat"][rows, b] = Rotation.from_matrix(turned).as_quat(scalar_first=True)
    fields["body_inertia"][rows, b] = moments


def _about(mass: Array, way: Array) -> Array:
    """Inertia of point masses (n,) about points so far from them (n, 3), (n, 3, 3)."""
    square = (way**2).sum(axis=1)[:, None, None] * np.eye(3)
    return np.asarray(mass[:, None, None] * (square - way[:, :, None] * way[:, None, :]))


def _place(name: str, body: int, position: Array) -> Place:
    x, y, z = (float(value) for value in position)
    return Place(name, body, (x, y, z))


def _last(model: Any) -> Iterator[int]:
    """Bodies with joints that no other body with joints hangs on."""
    moving = [b for b in range(1, model.nbody) if model.body_dofnum[b]]
    carrying = set()
    for b in moving:
        above = int(model.body_parentid[b])
        while above:
            carrying.add(above)
            above = int(model.body_parentid[above])
    return (b for b in moving if b not in carrying)


def _anchor(model: Any, b: int) -> Array:
    """Where a body's last joint holds it, in its frame, (3,)."""
    joint = int(model.body_jntadr[b] + model.body_jntnum[b] - 1)
    return np.asarray(model.jnt_pos[joint], float)


def _tip(model: Any, b: int) -> Array:
    """The end of a body's geoms that is farthest from its joint, in its frame, (3,)."""
    start = _anchor(model, b)
    ends = [start]
    for g in range(int(model.body_geomadr[b]), int(model.body_geomadr[b] + model.body_geomnum[b])):
        turn = Rotation.from_quat(model.geom_quat[g], scalar_first=True)
        centre, halves = _extent(model, g)
        ways = np.concatenate([np.zeros((1, 3)), np.diag(halves), -np.diag(halves)])
        ends += list(model.geom_pos[g] + turn.apply(centre + ways))
    return np.asarray(max(ends, key=lambda end: float(np.linalg.norm(end - start))), float)


def _extent(model: Any, g: int) -> tuple[Array, NDArray[np.float64]]:
    """Middle of a geom and how far it reaches along its axes, in its own frame, both (3,).

    Of capsules and cylinders along their axis alone: at its end something is fixed.
    """
    long = (mujoco.mjtGeom.mjGEOM_CAPSULE, mujoco.mjtGeom.mjGEOM_CYLINDER)
    if int(model.geom_type[g]) in map(int, long):
        return np.zeros(3), np.array([0.0, 0.0, float(model.geom_size[g, 1])])
    if int(model.geom_type[g]) == int(mujoco.mjtGeom.mjGEOM_SPHERE):
        return np.zeros(3), np.zeros(3)
    box = np.asarray(model.geom_aabb[g], float)
    return box[:3], box[3:]
