"""What every equation promises beside what every simulator does."""

from __future__ import annotations

import numpy as np

from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.findings import Finding
from sims.simulator import Array
from sims.values import Values

#: Relative difference of a row alone from the same one in a batch that libraries may make.
ROUNDING = 1e-6
#: Part of an acceleration that is none.
LINEAR = 1e-8
#: Forces that are tried, in the joints' units: one is large enough for whatever is moved.
_FORCES = (1.0, 1e6, 1e12)


def parameters_by_row(
    simulator: EquationOfMotion | FirstOrderSystem, states: Array, actions: Array
) -> Finding:
    """Is a parameter that is one number for each row taken as the number that it was?

    Whoever fits parameters steps many values at once.
    """
    author = "acceleration" if isinstance(simulator, EquationOfMotion) else "derivative"
    remedy = (
        f"compute in {author} with columns such as {'q' if author[0] == 'a' else 'x'}[:, 0], and "
        "stack the results: np.stack([...], axis=1)"
    )
    whole = simulator.step(states, actions)
    for name, rows in _by_row(simulator, len(states)).items():
        says = f"{name} as one number for each row, shape (n,), "
        try:
            found = simulator.with_parameters(**{name: rows}).step(states, actions)
        except Exception as error:
            told = "" if "stack" in str(error) else f"; {remedy}"
            says += f"raises {type(error).__name__}: {error}{told}"
            return Finding("parameters by row", False, says)
        if not np.allclose(found, whole, rtol=ROUNDING, atol=0, equal_nan=True):
            return Finding("parameters by row", False, f"{says}gives other numbers; {remedy}")
    return Finding("parameters by row", True, "one number for each row acts like the same scalar")


def _by_row(simulator: EquationOfMotion | FirstOrderSystem, count: int) -> dict[str, Array]:
    """Every parameter that is a number, as one number for each row, (count,)."""
    return {
        name: np.full(count, parameter.value)
        for name, parameter in simulator.parameters.items()
        if not np.ndim(parameter.value)
    }


def acceleration_keeps(simulator: EquationOfMotion, states: Array, actions: Array) -> Finding:
    """Does the user's ``acceleration`` leave its arguments as they were?"""
    q, v = positions_and_rates(simulator, states)
    given = (q, v, actions.copy(), np.zeros_like(q))
    before = [array.copy() for array in given]
    with np.errstate(all="ignore"):
        values = Values(**simulator.parameter_values())
        simulator.acceleration(*given, values)
    kept = all(map(np.array_equal, given, before))
    changed = "are overwritten: compute with copies, q = q.copy(), and not in place"
    says = "are left as they were" if kept else changed
    return Finding("arguments of acceleration", kept, says)


def forces_act(simulator: EquationOfMotion, states: Array, actions: Array) -> Finding:
    """Does a force on each joint accelerate it? Friction, loads and springs are such forces."""
    q, v = positions_and_rates(simulator, states)
    values = Values(**simulator.parameter_values())

    def accelerations(force: Array, joint: int) -> Array:
        found = simulator.acceleration(q.copy(), v.copy(), actions.copy(), force, values)
        return np.asarray(found)[:, joint]

    for j, joint in enumerate(simulator.joints):
        with np.errstate(all="ignore"):
            free = accelerations(np.zeros_like(q), j)
            if not np.isfinite(free).any():
                continue  # which is another fault
            for size in _FORCES:
                force = np.zeros_like(q)
                force[:, j] = size
                if not np.array_equal(accelerations(force, j), free, equal_nan=True):
                    break
            else:
                says = (
                    f"acceleration does not change with the force on joint {joint.name!r}, so no "
                    f"effect could act there: add force[:, {j}] to the sum of forces"
                )
                return Finding("forces", False, says)
    return Finding("forces", True, "a force on each joint accelerates it")


def linear_in_forces(simulator: EquationOfMotion, states: Array, actions: Array) -> Finding:
    """Effects add forces, so twice the force must give twice the change of acceleration."""
    q, v = positions_and_rates(simulator, states)
    values = Values(**simulator.parameter_values())
    for j, joint in enumerate(simulator.joints):
        force = np.zeros((3, *q.shape))
        force[1:, :, j] = np.array([[1.0], [2.0]]) * simulator.force_scale(joint)
        rest, once, twice = (
            np.asarray(simulator.acceleration(q.copy(), v.copy(), actions.copy(), each, values))
            for each in force
        )
        bend = np.abs((twice - rest) - 2 * (once - rest))
        whole = np.isfinite(bend).all(axis=1)  # what is not finite is another fault
        if (
            bend[whole].size
            and bend[whole].max() > LINEAR * np.abs([rest, once, twice])[:, whole].max()
        ):
            says = (
                f"twice the force on {joint.name} does not change the acceleration by twice as "
                f"much: add force[:, {j}] to the sum of forces as it is"
            )
            return Finding("linear in forces", False, says)
    return Finding("linear in forces", True, "twice the force, twice the change of acceleration")


def positions_and_rates(simulator: EquationOfMotion, states: Array) -> tuple[Array, Array]:
    """What ``acceleration`` is given of some states, each (n, n_joints)."""
    names = [channel.name for channel in simulator.state_channels]
    q = states[:, [names.index(joint.position) for joint in simulator.joints]]
    return q, states[:, [names.index(str(joint.rate)) for joint in simulator.joints]]


def drive_tells(
    simulator: EquationOfMotion | FirstOrderSystem, states: Array, actions: Array
) -> Finding:
    """Does the user's ``drive_force`` give one force for each row and joint?"""
    check, shape = "drive_force", (len(states), len(simulator.joints))
    if not simulator.has_drive_force:
        return Finding(check, True, "is not told")
    asked: dict[str, dict[str, Array]] = {"": {}} | {
        f" where {name} is one number for each row": {name: rows}
        for name, rows in _by_row(simulator, len(states)).items()
    }
    for where, values in asked.items():
        try:
            found = simulator.with_parameters(**values).drive_forces(states, actions)
        except Exception as error:
            return Finding(check, False, f"raises {type(error).__name__}: {error}{where}")
        if np.shape(found) != shape:
            says = (
                f"returned shape {np.shape(found)} for {len(states)} rows{where}, expected {shape}:"
                " compute with columns such as u[:, 0], and stack: np.stack([...], axis=1)"
            )
            return Finding(check, False, says)
    return Finding(check, True, "gives one force for each row and joint")
