"""Channels that declare no scale: the answer is that of a simulator that declares one."""

import dataclasses

import numpy as np
import pytest
from held import path

from residual.gap import find_gap
from residual.gap.data.scales import in_measured_scales
from residual.trajectories import Trajectory
from sims.effects import Delay, library
from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.simulator import Channel, Parameter

DT, DRAG, GAIN, LAG = 0.02, 0.0093, 30.0, 0.15


class Turntable(EquationOfMotion):
    """A motor that counts in degrees and says nothing of sizes."""

    dt = DT
    state_channels = (
        Channel("angle", "deg", "position"),
        Channel("speed", "deg/s", "rate", rate_of="angle"),
    )
    action_channels = (Channel("volts", "V", "input", low=-12.0, high=12.0),)
    parameters = {
        "gain": Parameter(GAIN, "deg/s/V", "speed by voltage", low=0.0),
        "lag": Parameter(LAG, "s", "time constant", low=0.005),
    }

    def acceleration(self, q, v, u, force, p):
        return ((p.gain * u[:, 0] - v[:, 0]) / p.lag + force[:, 0])[:, None]


class Declared(Turntable):
    state_channels = tuple(
        dataclasses.replace(channel, scale=scale)
        for channel, scale in zip(Turntable.state_channels, (300.0, 150.0), strict=True)
    )


class Kettle(FirstOrderSystem):
    dt = 5.0
    state_channels = (Channel("temp", "degC", "other"),)
    action_channels = (Channel("power", "W", "input"),)

    def derivative(self, x, u, p):
        return u / 4000.0 - (x - 20.0) / 600.0


def record(seed):
    """Steps of voltage, and what SciPy integrates with a drag that no simulator has."""
    rng = np.random.default_rng(seed)
    volts = np.repeat(rng.uniform(-8.0, 8.0, 25), 20)

    def moves(_, x, u):
        return [x[1], (GAIN * u - x[1]) / LAG - DRAG * x[1] * abs(x[1])]

    states = path(moves, [0.0, 0.0], volts, DT, atol=1e-8)
    states = states + rng.normal(0.0, [0.1, 2.0], states.shape)
    return Trajectory(f"run {seed}", DT * np.arange(len(states)), states, volts[:, None])


def scales(simulator):
    return {channel.name: channel.scale for channel in simulator.physical_channels}


def test_sizes_are_those_of_the_log_where_none_is_declared():
    runs = [record(0), record(1)]
    found = in_measured_scales(Turntable(), runs)
    seen = np.concatenate([run.states for run in runs])
    assert scales(found)["speed"] == pytest.approx(np.abs(seen[:, 1]).max(), rel=0.1)
    assert scales(found)["angle"] == pytest.approx(np.ptp(seen[:, 0]) / 2, rel=0.1)
    assert in_measured_scales(Declared(), runs).physical_channels == Declared.state_channels
    # What is near 1 stays, so that nothing hangs on which records were made.
    small = [dataclasses.replace(run, states=run.states / 100.0) for run in runs]
    assert scales(in_measured_scales(Turntable(), small)) == {"angle": 1.0, "speed": 1.0}
    # Where a rate was not measured, its position tells.
    blind = [dataclasses.replace(run, states=run.states * [1.0, np.nan]) for run in runs]
    speed = scales(in_measured_scales(Turntable(), blind))["speed"]
    assert 0.5 < speed / scales(found)["speed"] < 2


def test_joints_and_effects_go_with_their_states():
    simulator = Kettle()
    plain = simulator.with_scales({"temp": 50.0})
    assert plain.force_scale(plain.joints[0]) == 50 * simulator.force_scale(simulator.joints[0])
    states, power = np.array([[40.0], [70.0]]), np.array([[800.0], [0.0]])
    np.testing.assert_array_equal(plain.step(states, power), simulator.step(states, power))


def test_what_an_effect_remembers_is_no_joint():
    """Else every command that is on its way would be one, and effects would be offered at each."""
    simulator = Kettle()
    late = simulator.with_effects([Delay("power", 300 * simulator.dt)]).with_scales({"temp": 50.0})
    assert [joint.name for joint in late.joints] == [joint.name for joint in simulator.joints]
    assert len(late.state_channels) > 300
    assert [str(one) for one in library(late)] == [str(one) for one in library(simulator)]


def test_a_drag_is_named_in_degrees_whether_or_not_sizes_are_declared():
    runs = [record(0), record(1)]
    for simulator in (Turntable(), Declared()):
        found = find_gap(simulator, runs)
        (named,) = [v for v in found.verdicts if v.kind != "needs_data"]
        assert (named.kind, named.effect) == ("confirmed", "quadratic_drag")
        number = named.parameters["coefficient"]
        assert number.value == pytest.approx(DRAG, rel=0.03) and number.low <= DRAG <= number.high
        # What is given back counts as the user's own simulator does.
        assert found.corrected.physical_channels == simulator.physical_channels
