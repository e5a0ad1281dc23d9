"""The channel whose errors stand in the first lines of an answer."""

from typing import ClassVar

import numpy as np

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims import Channel, FirstOrderSystem, Parameter


class Boat(FirstOrderSystem):
    """Its speed by thrust, and the temperature of its engine."""

    dt = 0.5
    state_channels = (
        Channel("speed", "m/s", "rate", scale=1.0),
        Channel("temperature", "degC", "other", scale=10.0),
    )
    action_channels = (Channel("thrust", "N", "input", scale=50.0),)
    parameters: ClassVar = {
        "mass": Parameter(50.0, "kg", "of the boat"),
        "drag": Parameter(10.0, "N s/m", "of the hull"),
        "time_constant": Parameter(40.0, "s", "of the engine"),
    }

    def derivative(self, x, u, p):
        push = (u[:, 0] - p.drag * x[:, 0]) / p.mass
        cooling = (20.0 + 0.2 * u[:, 0] - x[:, 1]) / p.time_constant
        return np.stack([push, cooling], axis=1)


def test_it_is_one_whose_error_shrinks():
    rng = np.random.default_rng(4)
    steps, fine = 480, 40
    thrust = np.repeat(rng.uniform(-100, 100, steps // 12), 12)
    states = np.zeros((steps + 1, 2))
    states[0, 1] = 20.0
    sun = 0.0
    for k in range(steps):
        v, t = states[k]
        sun += -0.02 * sun + rng.normal(0, 6.0)  # clouds, as no effect is
        for _ in range(fine):
            v += 0.5 / fine * (thrust[k] - 10.0 * v - 30.0 * np.tanh(v / 0.01)) / 50
            t += 0.5 / fine * (20.0 + 0.2 * thrust[k] + sun - t) / 40
        states[k + 1] = v, t
    states += rng.normal(0, [0.02, 0.02], states.shape)
    run = Trajectory("run", 0.5 * np.arange(steps + 1), states, thrust[:, None])
    found = find_gap(Boat(), [run], effects=["coulomb_friction"], horizon=10.0)
    assert "coulomb_friction" in {v.effect for v in found.verdicts if v.kind == "confirmed"}
    assert found.gap.channel == "speed"
    assert found.gap.after.value < 0.5 * found.gap.before.value
    cloudy = found.gap.by_channel["temperature"]
    # Beside its noise the other's error is the larger one.
    assert cloudy.before.value / cloudy.noise_floor.value > (
        found.gap.before.value / found.gap.noise_floor.value
    )
