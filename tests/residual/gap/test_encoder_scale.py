"""An encoder with other counts per turn, by SciPy, and where only one of two sensors is off."""

import functools

import numpy as np
import pytest
from held import path

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.effects import EncoderScale, exact_aliases, library
from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.simulator import Channel

DT, ROWS, HOLD = 0.02, 500, 12
NOISE = np.array([0.001, 0.01])


class Motor(EquationOfMotion):
    """Turns in proportion to its voltage: what its encoder reads too much may be a gain."""

    dt, pull, level = DT, 0.0, 6.0
    state_channels = (
        Channel("angle", "rad", "position"),
        Channel("speed", "rad/s", "rate", rate_of="angle"),
    )
    action_channels = (Channel("volts", "V", "input", low=-12.0, high=12.0),)
    parameters = {}

    def acceleration(self, q, v, u, force, p):
        return 8.0 * u[:, :1] - 5.0 * v[:, :1] - self.pull * np.sin(q[:, :1]) + force


class Swing(Motor):
    """The same with a weight, whose pull is not in proportion to the angle."""

    pull, level = 40.0, 7.0


class Tank(FirstOrderSystem):
    dt = 1.0
    state_channels = (Channel("level", "m", "other"),)
    action_channels = (Channel("flow", "m^3/s", "input"),)
    parameters = {}

    def derivative(self, x, u, p):
        return u - x


def moved(t, x, push, pull):
    return [x[1], push - 5.0 * x[1] - pull * np.sin(x[0])]


def logs(system, of_angle=1.0, of_speed=1.0, gain=1.0):
    """Two runs by SciPy, whose sensors read so many times what is there."""
    rng = np.random.default_rng(3)
    runs = []
    for k in range(2):
        volts = np.repeat(system.level * rng.uniform(-1, 1, ROWS // HOLD + 1), HOLD)[:ROWS, None]
        moves = functools.partial(moved, pull=system.pull)
        states = path(moves, [0.0, 0.0], 8.0 * gain * volts[:, 0], DT, rtol=1e-9, atol=1e-10)
        seen = states * [of_angle, of_speed] + rng.normal(0, NOISE, (ROWS + 1, 2))
        runs.append(Trajectory(f"run {k}", DT * np.arange(ROWS + 1), seen, volts))
    return runs


def test_the_position_and_its_rate_are_read_alike():
    start, volts = np.array([0.4, -1.0]), 5.0 * np.sin(np.arange(60.0))[:, None]
    shown = Swing(effects=[EncoderScale("angle", 0.05)]).rollout(1.05 * start, volts)
    np.testing.assert_allclose(shown, 1.05 * Swing().rollout(start, volts), rtol=1e-9)


def test_it_is_offered_where_a_position_has_a_rate():
    assert "encoder_scale@angle" in {str(effect) for effect in library(Motor())}
    assert not any("encoder" in str(effect) for effect in library(Tank()))
    with pytest.raises(ValueError, match=r"no channel is the rate of 'level': use sensor_scale"):
        EncoderScale("level").quantities(Tank())


def test_it_moves_as_a_gain_where_all_is_in_proportion():
    def twins(system):
        found = [set(a.effects) for a in exact_aliases(system) if not a.combination]
        return any({"encoder_scale@angle", "actuator_gain@volts"} <= one for one in found)

    assert twins(Motor()) and not twins(Swing())


@pytest.mark.parametrize("of_speed", [
    pytest.param(1.06, marks=pytest.mark.long, id="both read so"),
    pytest.param(1.0, id="the speed is right"),
])  # fmt: skip
def test_an_encoder_that_counts_too_much_is_named(of_speed):
    """Where the speed is right, a gain of that size was named in its place, and was certain."""
    result = find_gap(Swing(), logs(Swing, 1.06, of_speed))
    (named,) = (v for v in result.verdicts if v.parameters)
    assert named.label == "encoder_scale@angle"
    assert named.parameters["scale"].value == pytest.approx(0.06, abs=0.003)
    disagree = [one for one in result.quality if one.kind == "kinematics"]
    assert len(disagree) == (of_speed == 1.0)
    assert all("if it is angle that reads wrongly, both do now" in one.says for one in disagree)


def named(result):
    (one,) = (v for v in result.verdicts if v.parameters)
    return one


@pytest.mark.long
def test_a_gain_as_large_as_two_sensors_disagree_is_not_certain():
    one = named(find_gap(Motor(), logs(Motor, 1.15)))
    assert (one.kind, one.label) == ("ambiguous", "actuator_gain@volts")
    assert one.doubts == ("conventions",) and "encoder_scale@angle" in one.alternatives


@pytest.mark.long
@pytest.mark.parametrize("of_speed", [1.0, 1.04], ids=["both agree", "the speed reads more"])
def test_another_gain_is(of_speed):
    one = named(find_gap(Motor(), logs(Motor, 1.0, of_speed, gain=1.15)))
    assert (one.kind, one.label) == ("confirmed", "actuator_gain@volts")
    assert one.parameters["gain"].value == pytest.approx(0.15, abs=0.01)


@pytest.mark.long
def test_a_speed_that_reads_too_much_leaves_no_gap():
    result = find_gap(Motor(), logs(Motor, 1.0, 1.15))
    assert result.verdicts[0].kind == "no_gap" and not any(v.parameters for v in result.verdicts)
