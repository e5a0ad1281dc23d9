"""A quarter of a car whose shock absorber is harder in rebound: its body sinks on a rough road."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest
from held import path

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter

BODY, WHEEL, SPRING, TYRE, DT = 2.45, 1.0, 900.0, 2500.0, 0.005
REBOUND, COMPRESSION = 11.4, 3.8


class QuarterCar(EquationOfMotion):
    """With one damping both ways, by the height of the road."""

    dt = DT
    state_channels = (
        Channel("body", "m", "position", scale=0.02),
        Channel("body rate", "m/s", "rate", rate_of="body", scale=0.2),
        Channel("wheel", "m", "position", scale=0.02),
        Channel("wheel rate", "m/s", "rate", rate_of="wheel", scale=0.2),
    )
    action_channels = (Channel("road", "m", "input", scale=0.02),)
    parameters: ClassVar = {
        "body": Parameter(0.99 * BODY, "kg", "a quarter of the body", low=0.1),
        "wheel": Parameter(1.01 * WHEEL, "kg", "wheel and axle", low=0.05),
        "c": Parameter(7.5, "N s/m", "shock absorber", low=0.0, family="dissipation"),
    }

    def acceleration(self, q, v, u, force, p):
        strut = SPRING * (q[:, 0] - q[:, 1]) + p.c * (v[:, 0] - v[:, 1])
        wheel = force[:, 1] + strut - TYRE * (q[:, 1] - u[:, 0])
        return np.stack([(force[:, 0] - strut) / p.body, wheel / p.wheel], axis=1)


def log(rng):
    road = np.repeat(0.02 * rng.uniform(-1, 1, 60) * np.repeat([1.0, 0.3, 0.0], 20), 10)

    def rates(_, x, u):
        parting = x[1] - x[3]
        strut = SPRING * (x[0] - x[2]) + (REBOUND if parting > 0 else COMPRESSION) * parting
        return [x[1], -strut / BODY, x[3], (strut - TYRE * (x[2] - u)) / WHEEL]

    states = path(rates, np.zeros(4), road, DT)
    states[:, 1::2] = np.nan
    seen = np.round(states / 5e-5) * 5e-5
    return Trajectory("car", DT * np.arange(len(seen)), seen, road[:, None])


@pytest.mark.long
def test_a_body_that_sinks_while_it_is_shaken_is_pushed_by_nothing():
    rng = np.random.default_rng(62)
    found = find_gap(QuarterCar(), [log(rng) for _ in range(4)])
    sure = {one.label: one for one in found.verdicts if one.kind == "confirmed"}
    assert set(sure) == {"asymmetric_coupling_damping@body and wheel"}
    (damper,) = sure.values()
    assert damper.parameters["forward"].value == pytest.approx(3.8, rel=0.05)
    assert damper.parameters["ratio"].value == pytest.approx(1.0, abs=0.05)
