"""A pan head that turns as commanded, and a run of it."""

import numpy as np

from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.simulator import Channel


class Head(FirstOrderSystem):
    """A pan head that turns as commanded."""

    dt = 0.05
    state_channels = (Channel("pan", "deg", "other", scale=20.0),)
    action_channels = (Channel("speed", "deg/s", "input", low=-40.0, high=40.0),)

    def derivative(self, x, u, p):
        return u


def turning(seed=0, rows=300):
    """A run that ranges over tens of degrees."""
    rng = np.random.default_rng(seed)
    speed = np.repeat(rng.uniform(-30.0, 30.0, (1, rows // 30, 1)), 30, axis=1)
    pan = Head().rollout(np.array([[5.0]]), speed)[0] + 0.05 * rng.standard_normal((rows + 1, 1))
    return Trajectory("run", 0.05 * np.arange(rows + 1), pan, speed[0])
