"""What authors of equations return, and the joints of what they declare."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sims.motion import Acceleration, DriveForce
from sims.simulator import Array, Channel, Joint
from sims.values import Values


def by_joint(found: Any, shape: tuple[int, ...], what: str, column: str = "q") -> Array:
    """What the system's author returned, rows last; checked, since broadcasting hides errors."""
    plain = type(found) is np.ndarray and found.dtype == np.float64
    if not plain and np.iscomplexobj(found):
        raise ValueError(f"{what} returned complex numbers, expected real ones")
    if found is None:
        raise ValueError(f"{what} returned nothing: does it end with a return?")
    found = np.asarray(found, dtype=float)
    if found.shape != shape[::-1]:
        raise ValueError(
            f"{what} returned shape {found.shape}, expected {shape[::-1]}: one row for each "
            f"state. Compute with columns such as {column}[:, 0], since parameters are scalars or "
            "shape (n,), and stack the results on axis 1"
        )
    # A copy, since it may be one of the arrays that the author was given.
    return np.array(found.T, order="C")


def joint_of(rate: Channel, channels: Sequence[Channel]) -> Joint:
    """The joint of a rate channel, called after its position."""
    position = next((c for c in channels if c.name == rate.rate_of), None)
    if position is None:
        names = ", ".join(repr(c.name) for c in channels if c.kind == "position")
        raise ValueError(
            f"channel {rate.name!r} has rate_of={rate.rate_of!r}, expected the name of its "
            f"position, one of {names or 'none that is declared'}"
        )
    force = "N" if position.turn is None else "N m"
    return Joint(position.name, position.name, rate.name, force)


def force_is_added(
    acceleration: Callable[..., Any], joints: int, inputs: int, values: Mapping[str, Any]
) -> NDArray[np.bool_]:
    """Of which joints a force is an acceleration, since the author adds it as it is, (joints,).

    Args:
        acceleration: What the author wrote.
        joints, inputs: How many there are.
        values: Parameters by name.
    """
    force = np.vstack([np.zeros(joints), np.eye(joints)])
    rest, u = np.zeros_like(force), np.zeros((joints + 1, inputs))
    try:
        with np.errstate(all="ignore"):
            moved = np.asarray(acceleration(rest, rest, u, force, Values(**values)))
            if moved.shape == force.shape:
                return np.isclose(np.diag(moved[1:] - moved[0]), 1.0, rtol=1e-9)
    except Exception:  # what is wrong with it is told where a simulator is checked
        pass
    return np.zeros(joints, bool)


def mobility(
    acceleration: Callable[..., Any], j: int, places: Array, inputs: int, values: Mapping[str, Any]
) -> Array:
    """Acceleration of every joint at rest per unit force on joint ``j``, (n, joints).

    Args:
        acceleration: What the author wrote.
        j: The joint.
        places: Positions of all joints, (n, joints).
        inputs: How many there are.
        values: Parameters by name.
    """
    n = len(places)
    q, rest = np.concatenate([places, places]), np.zeros((2 * n, places.shape[1]))
    force = rest.copy()
    force[n:, j] = 1.0
    with np.errstate(all="ignore"):
        moved = acceleration(q, rest, np.zeros((2 * n, inputs)), force, Values(**values))
    return np.asarray(moved[n:] - moved[:n])


def force_of(acceleration: float, *moved: Array) -> float:
    """The force that makes an acceleration, by accelerations per unit force.

    Args:
        acceleration: Of a joint.
        moved: Of that joint at some places, each (n,): where all positions are zero, and elsewhere
            if the motion is not defined there, as that of a load on a rope of no length.
    """
    with np.errstate(all="ignore"):
        forces = [np.abs(acceleration / each) for each in moved]
    sound = [force[np.isfinite(force) & (force > 0)] for force in forces]
    first = next((force for force in sound if force.size), forces[0])
    return float(np.median(first))


def push_of_inputs(acceleration: Acceleration) -> DriveForce:
    """The force on the joints that does what the inputs do, (q, v, u, p) -> (joints, n).

    Args:
        acceleration: Linear in its force, joints first and rows last.
    """

    def push(q: Array, v: Array, u: Array, p: SimpleNamespace) -> Array:
        none = np.zeros_like(q)
        rest = acceleration(q, v, 0.0 * u, none, p)
        moved = []
        for j in range(len(q)):
            force = none.copy()
            force[j] = 1.0
            moved.append(acceleration(q, v, 0.0 * u, force, p) - rest)
        inputs = acceleration(q, v, u, none, p) - rest
        if len(q) == 1:
            return inputs / moved[0]
        matrix = np.stack(moved).transpose(2, 1, 0)
        try:
            found = np.linalg.solve(matrix, inputs.T[:, :, None])
        except np.linalg.LinAlgError:  # what has left all bounds
            matrix[np.linalg.det(matrix) == 0] = np.nan
            found = np.linalg.solve(matrix, inputs.T[:, :, None])
        return np.asarray(found, float)[:, :, 0].T

    return push


def beyond_rest(rates: Acceleration, pushes: bool, brakes: Collection[str] = ()) -> DriveForce:
    """What drives a first-order system, (q, v, u, p) -> (states, n): the change that its inputs
    make, or, where these do not push by themselves, all change beyond that at rest without input,
    since what a voltage makes of a speed falls as that rises (back EMF).

    Args:
        rates: What the author wrote, joints first and rows last.
        pushes: Whether inputs push by themselves.
        brakes: Parameters of what brakes the system, which is no part of its drive.
    """

    def drive(q: Array, v: Array, u: Array, p: SimpleNamespace) -> Array:
        none = np.zeros_like(v)
        loose = Values(**{**vars(p), **dict.fromkeys(brakes, 0.0)})
        with np.errstate(all="ignore"):
            found = rates(q, v, u, none, loose)
            found -= rates(q, v if pushes else none, 0.0 * u, none, loose)
        if brakes and not np.isfinite(found).all():  # what is divided by one of them
            return beyond_rest(rates, pushes)(q, v, u, p)
        return found

    return drive
