"""A motor whose back EMF was forgotten: its speed is as if something rubbed."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest
from held import path

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter

R, L, K, J, B, DT = 1.2, 4e-3, 0.05, 2.5e-4, 2e-4, 1e-3


class Motor(FirstOrderSystem):
    """Without back EMF; the winding is 2 % off."""

    dt = DT
    state_channels = (
        Channel("current", "A", "other", scale=5.0),
        Channel("speed", "rad/s", "rate", scale=100.0),
    )
    action_channels = (Channel("voltage", "V", "input", scale=12.0),)
    parameters: ClassVar = {
        "R": Parameter(1.02 * R, "ohm", "winding", low=0.01),
        "L": Parameter(L, "H", "winding", low=1e-5),
        "K": Parameter(K, "N m/A", "torque constant", low=1e-4),
        "J": Parameter(J, "kg m^2", "rotor", low=1e-6),
        "b": Parameter(B, "N m s/rad", "bearing", low=0.0, family="dissipation"),
    }

    def derivative(self, x, u, p):
        current = (u[:, 0] - p.R * x[:, 0]) / p.L
        return np.stack([current, (p.K * x[:, 0] - p.b * x[:, 1]) / p.J], axis=1)


def log(rng):
    volts = np.repeat(rng.uniform(-12, 12, 30).round(2), 50)
    states = path(
        lambda _, x, u: [(u - R * x[0] - K * x[1]) / L, (K * x[0] - B * x[1]) / J],
        [0.0, 0.0], volts, DT,
    )  # fmt: skip
    seen = states + np.array([0.03, 0.4]) * rng.standard_normal(states.shape)
    return Trajectory("motor", DT * np.arange(len(seen)), seen, volts[:, None])


@pytest.mark.long
def test_a_forgotten_back_emf_is_named_and_no_friction_that_stands_for_it():
    rng = np.random.default_rng(45)
    found = find_gap(Motor(), [log(rng) for _ in range(3)])
    (sure,) = [verdict for verdict in found.verdicts if verdict.kind == "confirmed"]
    assert sure.label == "coupling@current by speed"
    strength = sure.parameters["strength"]
    assert strength.value == pytest.approx(-K / L, rel=0.04)
    assert strength.unit == "A/rad"
