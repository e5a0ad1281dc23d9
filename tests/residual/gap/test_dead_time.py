"""An inverter whose dead time takes a voltage from the current, whichever way that flows."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest
from held import path

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter

R, L, K, J, B, LOST, DT = 0.62, 1.8e-3, 0.085, 6e-4, 2e-4, 0.75, 1e-3


class Drive(FirstOrderSystem):
    """Without dead time; the rotor is 2 % off."""

    dt = DT
    state_channels = (
        Channel("current", "A", "other", scale=5.0),
        Channel("speed", "rad/s", "rate", scale=50.0),
    )
    action_channels = (Channel("voltage", "V", "input", scale=8.0),)
    parameters: ClassVar = {
        "R": Parameter(R, "ohm", "winding", low=0.01),
        "J": Parameter(1.02 * J, "kg m^2", "rotor", low=1e-6),
    }

    def derivative(self, x, u, p):
        current = (u[:, 0] - p.R * x[:, 0] - K * x[:, 1]) / L
        return np.stack([current, (K * x[:, 0] - B * x[:, 1]) / p.J], axis=1)


def log(rng):
    volts = np.repeat(rng.uniform(-8, 8, 30).round(2), 50)

    def rates(_, x, u):
        lost = LOST * np.tanh(x[0] / 1e-3)
        return [(u - R * x[0] - K * x[1] - lost) / L, (K * x[0] - B * x[1]) / J]

    states = path(rates, [0.0, 0.0], volts, DT)
    seen = states + np.array([0.02, 0.15]) * rng.standard_normal(states.shape)
    return Trajectory("drive", DT * np.arange(len(seen)), seen, volts[:, None])


@pytest.mark.long
def test_a_voltage_lost_against_the_current_is_named_and_no_play_of_the_command():
    rng = np.random.default_rng(76)
    found = find_gap(Drive(), [log(rng) for _ in range(3)])
    (sure,) = [verdict for verdict in found.verdicts if verdict.kind == "confirmed"]
    assert sure.label == "constant_loss@current"
    level = sure.parameters["level"]
    assert level.value == pytest.approx(LOST / L, rel=0.04)
    assert level.unit == "A/s"
