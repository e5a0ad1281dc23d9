"""A position and its rate on one scale are left alone, whatever noise each has."""

import numpy as np
import pytest

from residual.gap.data.kinematics import kinematics
from residual.trajectories import Trajectory
from sims.pendulum_equation import PendulumEquation


def upright(seed, scale, smoothed, rough=0.02):
    """A pendulum that is held near a place, so that noise is a good part of what it does."""
    rng, dt = np.random.default_rng(seed), 0.01
    times = dt * np.arange(3000)
    waves = rng.uniform(1, 12, 8), rng.uniform(0, 6, 8), rng.uniform(0.004, 0.012, 8)
    angle = sum(a * np.sin(w * times + p) for w, p, a in zip(*waves, strict=True))
    rate = sum(a * w * np.cos(w * times + p) for w, p, a in zip(*waves, strict=True))
    noise = rng.normal(0, rough, len(times))
    for k in range(1, len(times)):  # a filter behind the sensor of the angle
        noise[k] = smoothed * noise[k - 1] + (1 - smoothed) * noise[k]
    seen = np.stack([scale * angle + noise, rate + rng.normal(0, 5 * rough, len(times))], axis=1)
    return Trajectory(f"run {seed}", times, seen, np.zeros((len(times) - 1, 1)))


@pytest.mark.parametrize("smoothed", [0.0, 0.8])
@pytest.mark.parametrize("seed", range(3))
def test_noise_is_no_scale(seed, smoothed):
    assert not kinematics(PendulumEquation(), [upright(seed, 1.0, smoothed)])[1]


def test_a_scale_is_told_amid_noise():
    _, (found,) = kinematics(PendulumEquation(), [upright(0, 1.5, 0.0, rough=0.004)])
    assert found.numbers["scale"] == pytest.approx(1.5, rel=0.05)
