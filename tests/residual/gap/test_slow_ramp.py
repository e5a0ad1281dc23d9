"""A command that is raised slowly from rest is no late switch, and no drift."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from residual.gap.confirmation.drift import beside
from residual.gap.data.examine import examine
from residual.gap.data.sweeps import sweeps
from residual.trajectories import Trajectory
from sims import Channel, FirstOrderSystem, Parameter

DT, ROWS, DEAD = 0.5, 126, 25.0


class Motor(FirstOrderSystem):
    """A geared motor whose speed is in proportion to its command."""

    dt = DT
    state_channels = (Channel("speed", "rpm", "rate", scale=200.0),)
    action_channels = (Channel("pwm", "1", "input", scale=150.0, low=-255.0, high=255.0),)
    parameters = {
        "gain": Parameter(2.4, "rpm", "speed per count", low=0.01),
        "time_constant": Parameter(0.2, "s", "of the motor", low=0.01),
    }

    def derivative(self, x, u, p):
        return ((p.gain * u[:, 0] - x[:, 0]) / p.time_constant)[:, None]


def ramp():
    """A record of one that sticks up to 50 counts, and then runs as it does beyond a dead zone."""
    pwm = np.linspace(1.0, 253.0, ROWS)
    felt = np.where(pwm < 50.0, 0.0, pwm - DEAD)
    speed, decay = np.zeros(ROWS), np.exp(-DT / 0.2)
    for k in range(ROWS - 1):
        speed[k + 1] = decay * speed[k] + (1 - decay) * 2.4 * felt[k]
    speed += np.where(speed > 0, np.random.default_rng(0).normal(0.0, 0.7, ROWS), 0.0)
    return Trajectory("ramp", DT * np.arange(ROWS), speed[:, None], pwm[:-1, None])


def test_a_slow_ramp_is_no_late_switch():
    done = examine(Motor(), [ramp()])
    assert len(done.trajectories[0]) == ROWS - 1
    assert "onset" not in {finding.kind for finding in done.findings}


def swept(*commands):
    """Which inputs are told to go one way only, of records of such commands."""
    runs = [
        Trajectory(f"run {i}", DT * np.arange(len(u) + 1), np.zeros((len(u) + 1, 1)), u[:, None])
        for i, u in enumerate(commands)
    ]
    return [finding.where for finding in sweeps(Motor(), runs)]


def test_a_single_sweep_one_way_is_told():
    up, noise = np.linspace(1.0, 253.0, 60), np.random.default_rng(0).normal(0.0, 0.5, 60)
    assert swept(up) == swept(-up) == swept(up + noise) == ["pwm"]
    for others in (
        [up, up], [np.append(up, up[::-1])], [np.repeat([0.0, 200.0], 30)], [0 * up],
        [np.repeat([0.0, 50, 100, 150], 20)],
    ):  # fmt: skip
        assert swept(*others) == []


def test_a_push_that_grows_as_the_command_does_leaves_sizes_as_they_are():
    """Both move alike but for what slopes by differences do not resolve."""
    rng = np.random.default_rng(0)
    rising = np.linspace(0.0, 1.0, 40).reshape(4, 10, 1)
    left = 3.0 * rising[..., 0] + 0.01 * rng.standard_normal((4, 10))
    fit = SimpleNamespace(
        by_knob=rising + 1e-5 * rng.standard_normal(rising.shape), projected=left,
        weights=np.ones(4), merit=float((left**2).sum()), theta=np.zeros(1),
    )  # fmt: skip
    assert abs(beside(fit, [rising], 1e3).theta[0]) < 4.0
