"""A rotor that the teeth of its motor catch now and then: far ahead it goes one way or another."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
import pytest

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter

J, B, SINE, COSINE, TEETH, DT = 2.2e-3, 0.012, 0.025, 0.01, 12, 4e-3
STEP = math.tau / 4096


class Hub(EquationOfMotion):
    """Without teeth."""

    dt = DT
    state_channels = (
        Channel("angle", "rad", "position", angle=True),
        Channel("rate", "rad/s", "rate", rate_of="angle", scale=5.0),
    )
    action_channels = (Channel("torque", "N m", "input", scale=0.1),)
    parameters: ClassVar = {
        "inertia": Parameter(J, "kg m^2", "rotor", low=1e-5),
        "drag": Parameter(B, "N m s/rad", "bearing", low=0.0, family="dissipation"),
    }

    def acceleration(self, q, v, u, force, p):
        return ((u[:, 0] + force[:, 0] - p.drag * v[:, 0]) / p.inertia)[:, None]


def turned(rng, rows=1500, substeps=8):
    """A record of an encoder, the rotor stepped so finely that its steps do not show."""
    torques = np.repeat(rng.uniform(-0.1, 0.1, rows // 50), 50)
    angle, rate, seen = rng.uniform(0, math.tau), 0.0, []
    for torque in torques:
        seen.append(round(angle / STEP) * STEP)
        for _ in range(substeps):
            teeth = SINE * math.sin(TEETH * angle) + COSINE * math.cos(TEETH * angle)
            rate += DT / substeps * (torque - B * rate + teeth) / J
            angle += DT / substeps * rate
    states = np.column_stack([seen, np.full(rows, np.nan)])
    return Trajectory("hub", DT * np.arange(rows), states, torques[:-1, None])


@pytest.mark.long
def test_what_far_forecasts_hide_is_named():
    rng = np.random.default_rng(41)
    found = find_gap(Hub(), [turned(rng) for _ in range(4)])
    first = found.verdicts[0]
    assert (first.label, first.shape["order"]) == ("cogging@angle", TEETH)
    assert first.parameters["sine"].value == pytest.approx(SINE, rel=0.05)
    assert first.parameters["cosine"].value == pytest.approx(COSINE, rel=0.1)
    assert found.gap.after.value < 0.1 * found.gap.before.value
