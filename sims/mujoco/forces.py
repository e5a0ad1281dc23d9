"""Effects on joints: as attributes of the model where MuJoCo has them, else as forces."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from sims.effects.friction import CoulombFriction, DryFriction
from sims.effects.joint import (
    ConstantLoad,
    CubicSpring,
    JointEffect,
    LinearSpring,
    QuadraticDrag,
    ViscousFriction,
)
from sims.effects.link import Link
from sims.mujoco.attributes import repeated
from sims.mujoco.compiled import INTEGRATORS
from sims.mujoco.rows import Law
from sims.simulator import Array

RK4 = INTEGRATORS["RK4"]

#: A joint and its degree of freedom.
Place = tuple[int, int]
#: An effect, its joint and the joint's degree of freedom.
Placed = tuple[JointEffect, int, int]
#: A link with the places of both its joints.
Linked = tuple[Link, Place, Place]


def place(
    model: Any,
    effects: Sequence[Placed],
    links: Sequence[Linked],
    fields: dict[str, Array],
    rows: int,
) -> tuple[Array | None, Law | None]:
    """Put effects into the model's fields; what has no field becomes a force.

    Args:
        model: The compiled nominal.
        effects: What acts on which joint.
        links: What acts between which joints.
        fields: Fields with an entry per row; those that effects change are added or changed.
        rows: Number of rows.

    Returns:
        Constant generalized forces (rows, nv), and the law of those that follow the state.
    """
    applied: Array | None = None
    rest: list[Placed] = []
    for placed in effects:
        effect, _, d = placed
        if type(effect) is ConstantLoad:
            applied = np.zeros((rows, model.nv)) if applied is None else applied
            applied[:, d] += effect.load
        elif not _native(model, placed, fields, rows):
            rest.append(placed)
    return applied, _law(model, rest, links, fields, rows) if rest or links else None


def native(model: Any, effect: JointEffect, j: int) -> bool:
    """Whether MJCF has an attribute for an effect on a joint."""
    if type(effect) is CubicSpring:
        return bool(np.all(np.asarray(effect.rest) == _reference(model, j)))
    if type(effect) is CoulombFriction:
        return _plain(effect)
    return type(effect) in (ViscousFriction, QuadraticDrag, LinearSpring, ConstantLoad)


def _plain(effect: CoulombFriction) -> bool:
    """Whether the friction is of one size in both directions."""
    others = [np.asarray(getattr(effect, name)) for name in effect.numbers() if name != "level"]
    return not any(np.any(other) for other in others)


def _native(model: Any, placed: Placed, fields: dict[str, Array], rows: int) -> bool:
    effect, j, d = placed
    if not native(model, effect, j):
        return False

    def field(name: str) -> Array:
        if name not in fields:
            fields[name] = repeated(model, name, rows)
        return fields[name]

    # Below zero these would drive the joint; trial steps of finite differences go there.
    if type(effect) is ViscousFriction:
        field("dof_damping")[:, d] += np.maximum(effect.coefficient, 0.0)
    elif type(effect) is QuadraticDrag:
        field("dof_dampingpoly")[:, d, 0] += np.maximum(effect.coefficient, 0.0)
    elif type(effect) is CoulombFriction:
        field("dof_frictionloss")[:, d] += np.maximum(effect.level, 0.0)
    elif type(effect) is CubicSpring:
        field("jnt_stiffnesspoly")[:, j, 1] += effect.stiffness
    elif type(effect) is LinearSpring:
        stiffness, at = field("jnt_stiffness"), int(model.jnt_qposadr[j])
        reference = field("qpos_spring")
        added = np.broadcast_to(np.asarray(effect.stiffness, float), (rows,))
        both = stiffness[:, j] + added
        moved = stiffness[:, j] * reference[:, at] + added * effect.rest
        there = (added != 0) & (both != 0)
        reference[:, at] = np.where(there, moved / np.where(there, both, 1.0), reference[:, at])
        stiffness[:, j] = both
    return True


def _reference(model: Any, j: int) -> float:
    return float(model.qpos_spring[int(model.jnt_qposadr[j])])


def _law(
    model: Any,
    effects: Sequence[Placed],
    links: Sequence[Linked],
    fields: dict[str, Array],
    rows: int,
) -> Law:
    dry = [placed for placed in effects if isinstance(placed[0], DryFriction)]
    smooth = [placed for placed in effects if not isinstance(placed[0], DryFriction)]
    friction = "dof_frictionloss"
    held = fields.get(friction, repeated(model, friction, rows)) if dry else None

    # Held over a step that Runge-Kutta follows inside, a force is best that of its middle.
    half = 0.5 * float(model.opt.timestep) if model.opt.integrator == RK4 else 0.0

    def position(q: Array, v: Array, j: int, d: int) -> Array:
        return q[:, int(model.jnt_qposadr[j])] + half * v[:, d]

    def law(q: Array, v: Array) -> tuple[Array, dict[str, Array]]:
        force = np.zeros((len(q), model.nv))
        for effect, j, d in smooth:
            force[:, d] += effect.force(position(q, v, j, d), v[:, d])
        for link, (i, a), (j, b) in links:
            there = position(q, v, i, a), position(q, v, j, b)
            both = link.flows(there, (v[:, a], v[:, b]))
            force[:, a] += both[0]
            force[:, b] += both[1]
        if held is None:
            return force, {}
        # Dry friction of a size that follows the rate: the solver's own, with a new limit.
        now = held.copy()
        for effect, _, d in dry:
            assert isinstance(effect, DryFriction)
            now[:, d] += np.maximum(effect.limit(v[:, d]), 0.0)
        return force, {friction: now}

    return law
