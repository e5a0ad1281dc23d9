"""A tank with a hole: its loss goes by the root of the level, in no proportion to it."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest
from held import path

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter

AREA, HOLE, DT = 0.8, 0.012, 5.0


class Tank(FirstOrderSystem):
    """Without the hole, and 1 % too wide."""

    dt = DT
    state_channels = (Channel("level", "m", "other", scale=1.0),)
    action_channels = (Channel("inflow", "m^3/s", "input", low=0.0, high=0.05, scale=0.02),)
    parameters: ClassVar = {"area": Parameter(1.01 * AREA, "m^2", "of the tank", low=0.1)}

    def derivative(self, x, u, p):
        return u / np.reshape(p.area, (-1, 1))


def log(rng):
    flows = np.repeat(rng.uniform(0.0, 0.025, 20).round(4), 12)

    def rates(_, x, u):
        return [(u - HOLE * np.sqrt(max(x[0], 0.0))) / AREA]

    levels = path(rates, [rng.uniform(0.2, 2.0)], tuple(flows), DT)
    seen = levels + 0.004 * rng.standard_normal(levels.shape)
    return Trajectory("tank", DT * np.arange(len(seen)), seen, flows[:, None])


def test_a_hole_is_told_from_a_loss_in_proportion():
    rng = np.random.default_rng(77)
    found = find_gap(Tank(), [log(rng) for _ in range(2)])
    (sure,) = [one for one in found.verdicts if one.kind == "confirmed"]
    assert sure.label == "power_loss@level"
    assert sure.parameters["power"].value == pytest.approx(0.5, abs=0.06)
    true = HOLE * np.sqrt(sure.shape["full"]) / AREA
    assert sure.parameters["level"].value == pytest.approx(true, rel=0.03)
