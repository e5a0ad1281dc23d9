"""What an author wrote, altered: inertia that a joint takes along, a medium that moves, a drive
that makes no more than so much.

Joints first and rows last. Numbers of what alters it are kept among the parameters, which are cut
to rows as they are.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np

from sims.effects.base import Effect
from sims.effects.drive_limit import DriveLimit
from sims.effects.flow import AmbientFlow
from sims.effects.inertia import InertiaEffect
from sims.motion import Acceleration, DriveForce
from sims.simulator import Array


def carrying(
    acceleration: Acceleration, inertias: Mapping[str, tuple[int, InertiaEffect]]
) -> Acceleration:
    """The accelerations with inertia that moves with one joint alone.

    Args:
        acceleration: Without it.
        inertias: Numbers of joints and what each takes along, by the beginning of the names of the
            parameters that hold its numbers.
    """
    if not inertias:
        return acceleration

    def slowed(q: Array, v: Array, u: Array, force: Array, p: SimpleNamespace) -> Array:
        own = [(j, e.with_values(**numbers_in(p, name, e))) for name, (j, e) in inertias.items()]
        force = force.copy()
        for j, effect in own:
            force[j] -= 0.5 * effect.slope_at(q[j]) * v[j] ** 2
        found = acceleration(q, v, u, force, p)
        moved = []  # by a unit force on each of the joints
        for j, _ in own:
            more = force.copy()
            more[j] += 1.0
            moved.append(acceleration(q, v, u, more, p) - found)
        # One inertia after the other, by the formula of Sherman and Morrison.
        for i, (j, effect) in enumerate(own):
            inertia = effect.inertia_at(q[j])
            share = inertia / (1 + inertia * moved[i][j])
            for other in range(i + 1, len(moved)):
                moved[other] = moved[other] - moved[i] * (share * moved[other][j])
            found = found - moved[i] * (share * found[j])
        return found

    return slowed


def in_flows(
    acceleration: Acceleration, flows: Mapping[str, tuple[int, AmbientFlow]]
) -> Acceleration:
    """The accelerations where a medium moves along some joints; arguments as of ``carrying``."""
    if not flows:
        return acceleration

    def through(q: Array, v: Array, u: Array, force: Array, p: SimpleNamespace) -> Array:
        v = v.copy()
        for name, (j, flow) in flows.items():
            v[j] -= numbers_in(p, name, flow)["speed"]
        return acceleration(q, v, u, force, p)

    return through


def held_back(
    acceleration: Acceleration, drive: DriveForce, limits: Mapping[str, tuple[int, DriveLimit]]
) -> tuple[Acceleration, DriveForce]:
    """The accelerations, and the force of the drives, where some are limited; arguments as of
    ``carrying``, and of ``sims.motion.Motion``."""
    if not limits:
        return acceleration, drive

    def lacking(push: Array, p: SimpleNamespace) -> Array:
        found = np.zeros_like(push)
        for name, (j, limit) in limits.items():
            found[j] = limit.with_values(**numbers_in(p, name, limit)).lacking(push[j])
        return found

    def slower(q: Array, v: Array, u: Array, force: Array, p: SimpleNamespace) -> Array:
        return acceleration(q, v, u, force + lacking(drive(q, v, u, p), p), p)

    def weaker(q: Array, v: Array, u: Array, p: SimpleNamespace) -> Array:
        push = drive(q, v, u, p)
        return push + lacking(push, p)

    return slower, weaker


def numbers_in(p: SimpleNamespace, name: str, effect: Effect) -> dict[str, Any]:
    """Numbers of an effect that are kept among the parameters, by the beginning of their names."""
    return {field: getattr(p, f"{name} {field}") for field in effect.numbers()}
