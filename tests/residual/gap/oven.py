"""An oven that warms up as a first-order system, and its records in closed form."""

from typing import ClassVar

import numpy as np

from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter

GAIN, SLOW, LAG = 80.0, 40.0, 8.0


class Oven(FirstOrderSystem):
    """Without what is missing, such as that its heater lags."""

    dt = 1.0
    state_channels = (Channel("level", "K", "other", scale=30.0),)
    action_channels = (Channel("duty", "1", "input", scale=0.5, low=0.0, high=1.0),)
    parameters: ClassVar = {
        "gain": Parameter(GAIN, "K", "level at full duty", low=1.0),
        "slow": Parameter(SLOW, "s", "time constant", low=1.0),
    }

    def derivative(self, x, u, p):
        return ((p.gain * u[:, 0] - x[:, 0]) / p.slow)[:, None]


def steps(seed, duties, before, lag=LAG, hold=60):
    """A record in closed form: steps through a lag and the oven, settled at ``before`` at first."""
    times = np.arange(hold * len(duties), dtype=float)
    level = np.full(len(times), GAIN * before)
    for i, change in enumerate(np.diff([before, *duties])):
        t = np.maximum(times - i * hold, 0.0)
        late = lag * np.exp(-t / lag) if lag else 0.0
        level += GAIN * change * (1 - (SLOW * np.exp(-t / SLOW) - late) / (SLOW - lag))
    seen = level + np.random.default_rng(seed).normal(0, 0.05, len(times))
    actions = np.repeat(duties, hold)[:-1, None]
    return Trajectory(f"run {seed}", times, seen[:, None], actions)
