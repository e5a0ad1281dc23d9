"""Numbers of a joint that a motor drives, as the compiled kernel of ``sims.kick`` wants them."""

from __future__ import annotations

from typing import NamedTuple

from sims.simulator import Array


class DrivenJoint(NamedTuple):
    """What moves, without what depends on the angle; SI units.

    Args:
        inertia: About the joint.
        damping: Torque of the bearing per rate.
        drive: Motor torque per input at rest.
        back: Loss of motor torque per rate.
        drag: Torque per squared rate.
        coulomb: Dry friction of constant size.
        sliding, breakaway, speed: Dry friction that drops with the rate, Stribeck's.
        width: Play between motor and joint.
        own_torque: Address of a C function (angle, rate) -> torque, 0 for none.
        own_limit: Address of a C function (speed, 0) -> size of dry friction, 0 for none.
    """

    inertia: float
    damping: float
    drive: float
    back: float
    drag: float
    coulomb: float
    sliding: float
    breakaway: float
    speed: float
    width: float
    own_torque: int
    own_limit: int


class Field(NamedTuple):
    """Torques that depend on the angle alone.

    Args:
        weight: Torque of gravity when level.
        constant: A torque that never changes.
        springs: (k, 3): stiffness, rest, and 1 (linear) or 3 (cubic).
        waves: (k, 3): torques that repeat, sine, cosine and order.
        own: Address of a C function (angle, 0) -> torque, 0 for none.
    """

    weight: float
    constant: float
    springs: Array
    waves: Array
    own: int
