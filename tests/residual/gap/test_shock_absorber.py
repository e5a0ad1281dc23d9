"""A damper that is harder one way than the other: over time it pushes."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest
from held import path

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter

MASS, SPRING, FORWARD, BACK, DT = 250.0, 18000.0, 2600.0, 900.0, 0.01


class Seat(EquationOfMotion):
    """With one damping both ways, and ballast 2 % too light."""

    dt = DT
    state_channels = (
        Channel("place", "m", "position", scale=0.05),
        Channel("rate", "m/s", "rate", rate_of="place", scale=0.4),
    )
    action_channels = (Channel("load", "N", "input", scale=600.0),)
    parameters: ClassVar = {
        "mass": Parameter(0.98 * MASS, "kg", "seat", low=1.0),
        "c": Parameter(1500.0, "N s/m", "damper", low=0.0, family="dissipation"),
    }

    def acceleration(self, q, v, u, force, p):
        return ((u[:, 0] + force[:, 0] - p.c * v[:, 0] - SPRING * q[:, 0]) / p.mass)[:, None]


def log(rng):
    loads = np.repeat(rng.uniform(-900, 900, 40).round(), 20)

    def rates(_, x, u):
        return [x[1], (u - (FORWARD if x[1] > 0 else BACK) * x[1] - SPRING * x[0]) / MASS]

    states = path(rates, [0.0, 0.0], loads, DT)
    seen = states + np.array([1e-4, np.nan]) * rng.standard_normal(states.shape)
    return Trajectory("seat", DT * np.arange(len(seen)), seen, loads[:, None])


@pytest.mark.long
def test_a_shock_absorber_is_no_constant_push():
    rng = np.random.default_rng(76)
    found = find_gap(Seat(), [log(rng) for _ in range(3)])
    sure = {one.label: one for one in found.verdicts if one.kind == "confirmed"}
    assert set(sure) == {"asymmetric_damping@place", "viscous_friction@place"}
    more = sure["asymmetric_damping@place"].parameters["forward"]
    assert more.value == pytest.approx((FORWARD - BACK) / 2, rel=0.03)
