"""Under an input that never changes a gain is a load, a dead zone, a bias: all are told."""

from typing import ClassVar

import numpy as np

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter


class Wheel(FirstOrderSystem):
    """A wheel that a motor spins up."""

    dt = 0.02
    state_channels = (Channel("speed", "rad/s", "rate", scale=100.0),)
    action_channels = (Channel("voltage", "V", "input", scale=6.0, low=-12.0, high=12.0),)
    parameters: ClassVar = {
        "slope": Parameter(25.0, "rad/s/V", "free speed per volt", low=0.1),
        "time_constant": Parameter(0.8, "s", "of the motor", low=0.01),
    }

    def derivative(self, x, u, p):
        return ((p.slope * u[:, 0] - x[:, 0]) / p.time_constant)[:, None]


def spin(seed):
    """From rest to 92 % of what the nominal wheel reaches, more slowly, in closed form."""
    times = 0.02 * np.arange(330)
    speed = 276.0 * (1 - np.exp(-times / 1.3))
    noise = np.random.default_rng(seed).normal(0, 2.0, len(times))
    return Trajectory(f"spin {seed}", times, (speed + noise)[:, None], np.full((329, 1), 12.0))


def test_every_cause_of_a_lower_speed_is_told():
    found = find_gap(Wheel(), [spin(0), spin(1)])
    told = {v.effect for v in found.verdicts}
    for verdict in found.verdicts:
        told |= {label.partition("@")[0] for label in verdict.alternatives}
        told |= {label.partition("@")[0] for names in verdict.together for label in names}
    assert {"time_constant", "actuator_gain", "dead_zone", "constant_load"} <= told
    assert {"saturation", "coulomb_friction"} & told
    assert not any(
        v.kind == "confirmed" and v.effect not in ("time_constant", "") for v in found.verdicts
    )
