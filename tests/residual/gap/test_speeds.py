"""Logs of a speed alone."""

import numpy as np
import pytest

from residual.gap import find_gap
from residual.gap.data import findings
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.simulator import Channel


class Motor(FirstOrderSystem):
    dt = 0.02
    state_channels = (Channel("speed", "rad/s", "other", scale=50.0),)
    action_channels = (Channel("drive", "V", "input", scale=5.0),)

    def derivative(self, x, u, p):
        return 10.0 * u - 2.0 * x


class DeclaredMotor(Motor):
    state_channels = (Channel("speed", "rad/s", "rate", scale=50.0),)


def rubbing(seed):
    """A motor's speed under steps of 1 s, dry friction of 12 rad/s^2, by another integrator."""
    rng = np.random.default_rng(seed)
    drive = np.repeat(rng.uniform(-6, 6, 10), 50)
    speed = [0.0]
    for volts in drive:
        v = speed[-1]
        for _ in range(200):  # implicit in the friction, so that it holds
            free = v + 1e-4 * (10.0 * volts - 2.0 * v)
            v = np.sign(free) * max(abs(free) - 1e-4 * 12.0, 0.0)
        speed.append(v)
    seen = np.array(speed)[:, None] + rng.normal(0, 0.1, (501, 1))
    return Trajectory(f"steps {seed}", 0.02 * np.arange(501), seen, drive[:, None])


def test_a_speed_that_is_not_declared_as_one_is_told():
    logs = [rubbing(0), rubbing(1)]
    (told,) = (one for one in findings(Motor(), logs) if one.kind == "undeclared")
    assert 'Channel("speed", "rad/s", "rate")' in told.says
    assert not any(one.kind == "undeclared" for one in findings(DeclaredMotor(), logs))
    found = find_gap(DeclaredMotor(), logs)
    first = found.verdicts[0]
    assert (first.kind, first.effect) == ("confirmed", "coulomb_friction")
    level = first.parameters["level"]
    assert level.low <= 12.0 <= level.high
    assert level.value == pytest.approx(12.0, rel=0.02)
    assert level.unit == "rad/s^2"
