"""Logs of a speed alone."""

import numpy as np
import pytest

from residual.gap import find_gap
from residual.gap.data.examine import findings
from residual.gap.fitting.forecasts import own_channels
from residual.trajectories import Trajectory
from sims.effects import ActuatorBias
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


class Turn(FirstOrderSystem):
    """A heading that follows its command: a position without a rate."""

    dt = 1.0
    state_channels = (Channel("heading", "rad", "position", angle=True),)
    action_channels = (Channel("turn", "rad/s", "input", scale=0.1, low=-0.2, high=0.2),)

    def derivative(self, x, u, p):
        return u


def turning(unit=1.0):
    rng = np.random.default_rng(0)
    turn = np.repeat(rng.uniform(-0.1, 0.1, 40), 10)
    heading = np.concatenate([[0.0], np.cumsum(turn + 0.02)]) + rng.normal(0, 1e-3, 401)
    return Trajectory("log", np.arange(401.0), heading[:, None], unit * turn[:, None])


def test_an_input_in_degrees_is_refused_with_their_name():
    with pytest.raises(ValueError, match=r"turn: reaches .* another unit \(deg/s for rad/s\)"):
        find_gap(Turn(), [turning(180 / np.pi)])


def test_a_position_that_has_no_rate_is_pushed_itself():
    found = find_gap(Turn(), [turning()], effects=[ActuatorBias("turn")])
    assert found.verdicts[0].effect == "actuator_bias"
    assert np.isclose(found.verdicts[0].parameters["bias"].value, 0.02, rtol=0.02)
    assert found.adequate


def test_rates_count_as_channels_of_their_own_where_no_position_was_measured():
    speed, heart = Channel("speed", "m/s", "rate"), Channel("heart", "1/min", "other")
    angle = Channel("angle", "rad", "position")
    rate = Channel("rate", "rad/s", "rate", rate_of="angle")
    assert own_channels([heart, speed]) == [0, 1]
    assert own_channels([angle, rate]) == [0]
    assert own_channels([rate]) == [0]
