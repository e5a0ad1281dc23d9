"""A motor whose amplifier gives no more than so much current."""

import numpy as np
import pytest
from held import path

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter


class Motor(FirstOrderSystem):
    """Its speed, under a voltage."""

    dt = 0.01
    state_channels = (Channel("speed", "rad/s", "rate", scale=100.0),)
    action_channels = (Channel("voltage", "V", "input", scale=6.0, low=-12.0, high=12.0),)

    def __init__(self):
        self.parameters = {
            "constant": Parameter(0.05, "V s/rad", "back EMF", low=1e-3),
            "resistance": Parameter(0.81, "ohm", "of the winding", low=0.01),
            "inertia": Parameter(5.1e-4, "kg m^2", "of the rotor", low=1e-6),
            "damping": Parameter(2e-4, "N m s/rad", "damping", low=0.0, family="dissipation"),
        }
        super().__init__()

    def derivative(self, x, u, p):
        current = (u[:, 0] - p.constant * x[:, 0]) / p.resistance
        return ((p.constant * current - p.damping * x[:, 0]) / p.inertia)[:, None]


def driven(seed, n=800):
    """6 A at most, dry friction of 0.012 N m; inertia and resistance 2 % off."""
    rng = np.random.default_rng(seed)
    volts = np.repeat(rng.uniform(-12, 12, n // 80), 80)

    def rates(_, x, volt):
        current = np.clip((volt - 0.05 * x) / 0.8, -6, 6)
        return (0.05 * current - 2e-4 * x - 0.012 * np.tanh(2 * x)) / 5e-4

    speed = path(rates, [0.0], volts, 0.01)[:-1]
    seen = 0.3 * np.round((speed + 0.5 * rng.standard_normal((n, 1))) / 0.3)
    return Trajectory(f"run {seed}", 0.01 * np.arange(n), seen, volts[:-1, None])


@pytest.mark.long
def test_a_limited_current_is_named_in_place_of_the_lag_that_it_looks_like():
    """It is 600 rad/s^2, and the friction that it hid 24."""
    found = find_gap(Motor(), [driven(seed) for seed in range(3)])
    sure = {v.label: v for v in found.verdicts if v.kind == "confirmed"}
    assert "drive_limit@speed" in sure and "actuator_lag@voltage" not in sure
    level = sure["drive_limit@speed"].parameters["level"]
    assert level.low < 600 < level.high and level.high - level.low < 60
    friction = next(v for v in found.verdicts if v.label == "coulomb_friction@speed")
    assert friction.parameters["level"].value == pytest.approx(24, rel=0.15)
