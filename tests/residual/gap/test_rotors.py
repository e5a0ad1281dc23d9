"""Rotors of an arm's motors, which the simulator does not know: no lengths and masses for them."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter

DT, GRAVITY = 0.01, 9.81
UPPER, LOWER, FIRST, SECOND = 1.2, 0.6, 0.4, 0.3


def joint(name):
    return (
        Channel(name, "rad", "position", scale=1.0),
        Channel(f"{name} rate", "rad/s", "rate", rate_of=name, scale=3.0),
    )


class Arm(EquationOfMotion):
    """Two links in a vertical plane with masses at their ends, motors without inertia."""

    dt = DT
    substeps = 2
    state_channels = (*joint("shoulder"), *joint("elbow"))
    action_channels = (
        Channel("shoulder torque", "N m", "input", scale=3.0),
        Channel("elbow torque", "N m", "input", scale=1.0),
    )
    parameters: ClassVar = {
        "upper": Parameter(1.01 * UPPER, "kg", "mass at the elbow", low=0.01),
        "lower": Parameter(0.985 * LOWER, "kg", "mass at the hand", low=0.01),
        "first": Parameter(FIRST, "m", "shoulder to elbow", low=0.01),
        "second": Parameter(SECOND, "m", "elbow to hand", low=0.01),
    }

    def acceleration(self, q, v, u, force, p):
        cross = p.lower * p.first * p.second
        bend, swing = cross * np.cos(q[:, 1]), cross * np.sin(q[:, 1])
        d = p.lower * p.second**2
        a, b = (p.upper + p.lower) * p.first**2 + d + 2 * bend, d + bend
        hand = GRAVITY * p.lower * p.second * np.sin(q[:, 0] + q[:, 1])
        elbow = GRAVITY * (p.upper + p.lower) * p.first * np.sin(q[:, 0])
        first = u[:, 0] + force[:, 0] + swing * v[:, 1] * (2 * v[:, 0] + v[:, 1])
        second = u[:, 1] + force[:, 1] - swing * v[:, 0] ** 2
        first, second = first - elbow - hand, second - hand
        both = np.stack([d * first - b * second, a * second - b * first], axis=1)
        return both / (a * d - b * b)[:, None]


def measured(rotors, seed, rows=500):
    """A record of the true arm: in a loop whose targets step."""
    rng = np.random.default_rng(seed)
    cross, d = LOWER * FIRST * SECOND, LOWER * SECOND**2

    def rates(_, x, u):
        bend, swing = cross * np.cos(x[1]), cross * np.sin(x[1])
        a, b = (UPPER + LOWER) * FIRST**2 + d + 2 * bend, d + bend
        matrix = np.array([[a + rotors[0], b], [b, d + rotors[1]]])
        hand = GRAVITY * LOWER * SECOND * np.sin(x[0] + x[1])
        elbow = GRAVITY * (UPPER + LOWER) * FIRST * np.sin(x[0])
        turned = [swing * x[3] * (2 * x[2] + x[3]) - elbow - hand, -swing * x[2] ** 2 - hand]
        forces = np.add(u, turned)
        return [*x[2:], *np.linalg.solve(matrix, forces)]

    targets = rng.uniform(-1, 1, (rows // 60 + 1, 2))
    x, states, torques = np.zeros(4), [], []
    for k in range(rows):
        torque = [20.0, 6.0] * (targets[k // 60] - x[:2]) - [3.0, 0.6] * x[2:]
        states.append(x[[0, 2, 1, 3]] + rng.normal(0, [5e-4, 0.02, 5e-4, 0.02]))
        torques.append(torque)
        x = solve_ivp(rates, (0, DT), x, args=(torque,), rtol=1e-8, atol=1e-10).y[:, -1]
    return Trajectory(f"run {seed}", DT * np.arange(rows), np.array(states), np.array(torques[:-1]))


@pytest.mark.long
@pytest.mark.parametrize("rotors", [(0.0, 0.02), (0.15, 0.03)])
def test_the_inertia_of_rotors_is_named_and_no_mass_or_length_for_it(rotors):
    offered = ("added_inertia", "viscous_friction", "delay", "upper", "lower", "first", "second")
    found = find_gap(Arm(), [measured(rotors, seed) for seed in range(3)], effects=offered)
    named = {v.label: v for v in found.verdicts if v.kind == "confirmed"}
    names = ["added_inertia@shoulder", "added_inertia@elbow"]
    assert set(named) == {name for name, inertia in zip(names, rotors, strict=True) if inertia}
    for name, inertia in zip(names, rotors, strict=True):
        if inertia:
            number = named[name].parameters["inertia"]
            assert number.low <= inertia <= number.high and number.unit == "kg m^2"
    assert found.gap.share.value > 0.99
