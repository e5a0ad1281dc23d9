"""A belt between two bodies, which no law of one of them imitates."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest
from held import path

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter

MASSES, SPRINGS, RUBS, DT = (1.2, 0.8), (60.0, 45.0), 1.5, 0.02
STIFFNESS, COEFFICIENT = 30.0, 1.5


class Carts(EquationOfMotion):
    """Two carts, each on a spring to its wall, the first 1 % too heavy."""

    dt = DT
    state_channels = (
        Channel("left", "m", "position", scale=0.1),
        Channel("left rate", "m/s", "rate", rate_of="left", scale=0.5),
        Channel("right", "m", "position", scale=0.1),
        Channel("right rate", "m/s", "rate", rate_of="right", scale=0.5),
    )
    action_channels = (Channel("push", "N", "input", scale=4.0),)
    parameters: ClassVar = {
        "first": Parameter(1.01 * MASSES[0], "kg", "first cart", low=0.1),
        "second": Parameter(MASSES[1], "kg", "second cart", low=0.1),
    }

    def acceleration(self, q, v, u, force, p):
        pull = force - np.array(SPRINGS) * q - RUBS * v
        pull[:, :1] += u
        return pull / np.stack([p.first + 0.0 * q[:, 0], p.second + 0.0 * q[:, 0]], axis=1)


def log(rng):
    pushes = np.repeat(rng.uniform(-6, 6, 40).round(1), 12)

    def rates(_, x, u):
        pull = -STIFFNESS * (x[0] - x[2]) - COEFFICIENT * (x[1] - x[3])
        own = [u + pull, -pull]
        rub = [own[i] - SPRINGS[i] * x[2 * i] - RUBS * x[2 * i + 1] for i in (0, 1)]
        return [x[1], rub[0] / MASSES[0], x[3], rub[1] / MASSES[1]]

    states = path(rates, [0.02, 0.0, 0.05, 0.0], tuple(pushes), DT)
    seen = states + np.array([5e-4, np.nan] * 2) * rng.standard_normal(states.shape)
    return Trajectory("carts", DT * np.arange(len(seen)), seen, pushes[:, None])


def test_a_belt_is_named_though_every_cart_has_springs_and_friction_of_its_own():
    rng = np.random.default_rng(77)
    found = find_gap(Carts(), [log(rng) for _ in range(2)])
    sure = {one.label: one for one in found.verdicts if one.kind == "confirmed"}
    assert set(sure) == {"coupling_spring@left and right", "coupling_damper@left and right"}
    spring = sure["coupling_spring@left and right"].parameters
    assert spring["stiffness"].value == pytest.approx(STIFFNESS, rel=0.05)
    assert spring["ratio"].value == pytest.approx(1.0, abs=0.05)
    damper = sure["coupling_damper@left and right"].parameters
    assert damper["coefficient"].value == pytest.approx(COEFFICIENT, rel=0.1)
