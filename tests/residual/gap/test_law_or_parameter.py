"""A curve by points that no motion can tell from a parameter which follows the same input."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest
from held import path

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter

BASE, UNDERSTEER, TAU, DT = 2.7, 0.0032, 0.14, 0.04


class Van(FirstOrderSystem):
    """The yaw rate of a van that rolls where its wheels point."""

    dt = DT
    state_channels = (Channel("yaw rate", "rad/s", "rate", scale=0.3),)
    action_channels = (
        Channel("speed", "m/s", "input", scale=15.0),
        Channel("steer", "rad", "input", scale=0.1),
    )
    parameters: ClassVar = {
        "base": Parameter(BASE, "m", "wheelbase", low=0.5),
        "tau": Parameter(TAU, "s", "response", low=0.01),
    }

    def derivative(self, x, u, p):
        return ((u[:, 0] * u[:, 1] / p.base - x[:, 0]) / p.tau)[:, None]


def log(rng):
    inputs = np.stack([rng.uniform(2, 26, 30), rng.uniform(-0.1, 0.1, 30)], axis=1)
    inputs = np.repeat(inputs, 30, axis=0)

    def rates(_, x, u):
        return [(u[0] * u[1] / (BASE + UNDERSTEER * u[0] ** 2) - x[0]) / TAU]

    states = path(rates, [0.0], [tuple(row) for row in inputs], DT)
    seen = states + 0.004 * rng.standard_normal(states.shape)
    return Trajectory("van", DT * np.arange(len(seen)), seen, inputs)


@pytest.mark.long
def test_a_curve_of_the_speed_may_be_a_wheelbase_that_grows_with_it():
    rng = np.random.default_rng(76)
    found = find_gap(Van(), [log(rng) for _ in range(3)])
    names = [(one.label, *one.same_motion) for one in found.verdicts if one.kind == "confirmed"]
    assert any("base" in " ".join(one) for one in names)
    assert not any("tau" in " ".join(one) for one in names)
