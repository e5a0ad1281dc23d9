"""The attributes of a model that may be wrong, by the names that MJCF gives them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping
from typing import Any

import mujoco
import numpy as np

from sims.effects.joint import LinearSpring, ViscousFriction
from sims.mujoco import elements, payload
from sims.mujoco.contacts import touching_geoms
from sims.simulator import Array, Parameter

Index = tuple[int, ...]

DISSIPATION = ViscousFriction.family
#: Change of a contact's friction, as a share of it, that should make it slip where it holds.
SLIPPING = -0.5
#: Times the whole of gravity that a part of it may be.
MOST_G = 1.2


@dataclasses.dataclass(frozen=True)
class Slot:
    """A number of the compiled model that an attribute sets.

    Args:
        field: Field of ``mujoco.MjModel``; those of ``MjOption`` as ``"opt.gravity"``.
        index: Entry of the field.
        scaled: Whether the entry is multiplied by the attribute's value over its nominal value,
            rather than set to the value.
    """

    field: str
    index: Index
    scaled: bool = False


@dataclasses.dataclass(frozen=True)
class Attribute:
    """One attribute, or a group of them that change together.

    Args:
        name: As in reports: ``"frictionloss of joint elbow"``.
        parameter: Its nominal value, unit, meaning, bounds, and the size of a change that matters.
        slots: What it sets in the compiled model.
        offered: Whether it is searched by default.
        place: Where it is a point mass, in place of slots.
    """

    name: str
    parameter: Parameter
    slots: tuple[Slot, ...] = ()
    offered: bool = True
    place: payload.Place | None = None


def attributes(model: Any) -> dict[str, Attribute]:
    """All attributes of a compiled model that may be wrong, by name."""
    found = [
        *_of_joints(model),
        *_of_bodies(model),
        *_payloads(model),
        *_of_actuators(model),
        *_of_contacts(model),
        *_of_the_world(model),
    ]
    return {attribute.name: attribute for attribute in found}


def nominal_field(model: Any, field: str) -> Array:
    """A field of ``MjModel``, or of its options as ``"opt.gravity"``."""
    if field.startswith("opt."):
        return np.asarray(getattr(model.opt, field[4:]))
    return np.asarray(getattr(model, field))


def row_fields(
    model: Any,
    known: Mapping[str, Attribute],
    values: Mapping[str, Any],
    rows: int,
) -> dict[str, Array]:
    """Fields with an entry per row, for the attributes that differ from their nominal values.

    Args:
        model: The compiled nominal.
        known: Its attributes.
        values: Their values by name, scalars or shape (rows,).
        rows: Number of rows.

    Returns:
        By field, shape (rows, ...). Rows at nominal values hold the nominal bits.
    """
    fields: dict[str, Array] = {}
    changed = []
    for name, attribute in known.items():
        value, nominal = values[name], attribute.parameter.value
        if np.ndim(value) == 0 and value == nominal:
            continue
        lowest = attribute.parameter.low
        # Below its bound an attribute is no physics: a negative frictionloss would drive.
        value = np.maximum(value, lowest) if math.isfinite(lowest) else value
        changed.append((attribute, np.broadcast_to(np.asarray(value, float), (rows,))))
    # What is set comes before what is multiplied, in whatever order attributes are listed, and
    # what is carried last.
    for scaled in (False, True):
        for attribute, value in changed:
            nominal = float(attribute.parameter.value)
            for slot in attribute.slots:
                if slot.scaled is not scaled:
                    continue
                array = fields.get(slot.field)
                if array is None:
                    array = fields[slot.field] = repeated(model, slot.field, rows)
                at: Any = (slice(None), *slot.index)
                array[at] = _scaled(array[at], value, nominal) if scaled else value
    for attribute, value in changed:
        if attribute.place is not None:
            for field in payload.FIELDS:
                fields.setdefault(field, repeated(model, field, rows))
            payload.load(fields, attribute.place, value)
    return fields


def repeated(model: Any, field: str, rows: int) -> Array:
    """The nominal field, once for each row."""
    nominal = nominal_field(model, field)
    return np.repeat(nominal[None].astype(float), rows, axis=0)


def _scaled(array: Array, value: Array, nominal: float) -> Array:
    return np.where(value == nominal, array, array * (value / nominal))


# -- by element ---------------------------------------------------------------------------


def _of_joints(model: Any) -> Iterator[Attribute]:
    forces, inertias = elements.typical_forces(model), elements.typical_inertias(model)
    damped = []
    for j in range(model.njnt):
        hinge = int(model.jnt_type[j]) == elements.HINGE
        if not hinge and int(model.jnt_type[j]) != elements.SLIDE:
            continue
        name, d = elements.name_of("joint", model, j), int(model.jnt_dofadr[j])
        force = float(forces[d])
        rate = elements.TURNING if hinge else elements.SLIDING
        f, q = ("N m", "rad") if hinge else ("N", "m")

        def at_least_zero(
            what: str,
            value: float,
            unit: str,
            scale: float,
            slot: Slot,
            family: str = "",
            name: str = name,
        ) -> Attribute:
            full = f"{what} of joint {name}"
            parameter = Parameter(float(value), unit, full, 0.0, scale=scale, family=family)
            return Attribute(full, parameter, (slot,))

        yield at_least_zero(
            "damping", model.dof_damping[d], f"{f} s/{q}", force / rate,
            Slot("dof_damping", (d,)), DISSIPATION,
        )  # fmt: skip
        yield at_least_zero(
            "frictionloss",
            model.dof_frictionloss[d],
            f,
            0.1 * force,
            Slot("dof_frictionloss", (d,)), DISSIPATION,
        )  # fmt: skip
        yield at_least_zero(
            "quadratic damping", model.dof_dampingpoly[d, 0], f"{f} s^2/{q}^2", force / rate**2,
            Slot("dof_dampingpoly", (d, 0)), DISSIPATION,
        )  # fmt: skip
        yield at_least_zero(
            "armature", model.dof_armature[d], "kg m^2" if hinge else "kg", float(inertias[d]),
            Slot("dof_armature", (d,)),
        )  # fmt: skip
        if model.jnt_stiffness[j] > 0:
            stiffness = float(model.jnt_stiffness[j])
            yield at_least_zero(
                "stiffness", stiffness, f"{f}/{q}", stiffness, Slot("jnt_stiffness", (j,)),
                LinearSpring.family,
            )  # fmt: skip
        if model.dof_damping[d] > 0:
            damped.append(d)
    if len(damped) > 1:
        slots = [Slot("dof_damping", (d,), True) for d in damped]
        yield _group("damping of all joints", slots, DISSIPATION)


def _of_bodies(model: Any) -> Iterator[Attribute]:
    for b in range(1, model.nbody):
        mass = float(model.body_mass[b])
        if not mass or not model.body_dofnum[b]:
            continue
        name = elements.name_of("body", model, b)
        full = f"mass of body {name}"
        slots = (
            Slot("body_mass", (b,)),
            *(Slot("body_inertia", (b, k), True) for k in range(3)),
        )
        yield Attribute(full, Parameter(mass, "kg", full, 1e-3 * mass, scale=mass), slots)
        # A body is about as large as a solid sphere of its inertia.
        size = math.sqrt(2.5 * float(np.mean(model.body_inertia[b])) / mass)
        for k, axis in enumerate("xyz"):
            full = f"center of mass {axis} of body {name}"
            parameter = Parameter(float(model.body_ipos[b, k]), "m", full, scale=max(size, 1e-3))
            yield Attribute(full, parameter, (Slot("body_ipos", (b, k)),))


def _payloads(model: Any) -> Iterator[Attribute]:
    for place in payload.places(model):
        full = f"payload at {place.name}"
        mass = float(model.body_mass[place.body]) or float(model.body_mass.sum())
        parameter = Parameter(0.0, "kg", full, 0.0, scale=mass)
        yield Attribute(full, parameter, place=place)


def _of_actuators(model: Any) -> Iterator[Attribute]:
    every: list[Slot] = []
    for a in range(len(model.actuator_trntype)):
        slots = gain_slots(model, a)
        if not slots:
            continue
        every += slots
        yield _group(f"gain of actuator {elements.name_of('actuator', model, a)}", slots)
    if len({slot.index[0] for slot in every}) > 1:
        yield _group("gain of all actuators", every)


def gain_slots(model: Any, a: int) -> list[Slot]:
    """What makes an actuator stronger as a whole; empty if no factor does.

    The gear of a motor; the position and velocity gains of a servo together.
    """
    gain, bias = int(model.actuator_gaintype[a]), int(model.actuator_biastype[a])
    kinds, laws = mujoco.mjtGain, mujoco.mjtBias
    if int(model.actuator_outnum[a]) != 1:
        return []
    if gain == int(kinds.mjGAIN_FIXED) and bias == int(laws.mjBIAS_NONE):
        out = int(model.actuator_outadr[a])
        return [Slot("actuator_gear", (out, k), True) for k in range(6)]
    if gain in (int(kinds.mjGAIN_FIXED), int(kinds.mjGAIN_AFFINE)) and bias == int(
        laws.mjBIAS_AFFINE
    ):
        return [
            Slot(field, (a, k), True)
            for field in ("actuator_gainprm", "actuator_biasprm")
            for k in range(3)
        ]
    return []


def _of_contacts(model: Any) -> Iterator[Attribute]:
    geoms = touching_geoms(model)
    if not geoms:
        return
    every = _group("friction of all contacts", [Slot("geom_friction", (g, 0), True) for g in geoms])
    yield dataclasses.replace(every, parameter=dataclasses.replace(every.parameter, bold=SLIPPING))
    for g in geoms:
        full = f"friction of geom {elements.name_of('geom', model, g)}"
        value = float(model.geom_friction[g, 0])
        parameter = Parameter(value, "1", full, 0.0, scale=max(value, 0.1))
        yield Attribute(full, parameter, (Slot("geom_friction", (g, 0)),), offered=False)


def _of_the_world(model: Any) -> Iterator[Attribute]:
    size = float(np.linalg.norm(model.opt.gravity)) or 9.81
    for k, axis in enumerate("xyz"):
        full = f"gravity {axis}"
        value = float(model.opt.gravity[k])
        # However a base leans, no part of gravity is larger than the whole.
        parameter = Parameter(value, "m/s^2", full, -MOST_G * size, MOST_G * size, 0.1 * size)
        yield Attribute(full, parameter, (Slot("opt.gravity", (k,)),))


def _group(name: str, slots: list[Slot], family: str = "") -> Attribute:
    """A factor on several numbers, 1 by default."""
    parameter = Parameter(1.0, "1", name, 0.01, scale=1.0, family=family)
    return Attribute(name, parameter, tuple(slots))
