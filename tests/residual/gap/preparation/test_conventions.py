"""Logs that count signs, zeros and units otherwise than the simulator."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest

from residual.gap import find_gap
from residual.gap.beside import Conventions
from residual.gap.data.samples import Samples
from residual.gap.preparation.alternatives import conventions
from residual.gap.preparation.conventions import beyond_scale, otherwise, still_open
from residual.gap.preparation.prepare import prepare
from residual.trajectories import Trajectory
from sims.effects import (
    ActuatorGain,
    CoulombFriction,
    LinearSpring,
    SensorOffset,
    SensorScale,
)
from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.pendulum_equation import PendulumEquation
from sims.simulator import Channel

LARGE = [
    (), pytest.param((CoulombFriction("pivot", 0.01),), marks=pytest.mark.long),
    (LinearSpring("pivot", 0.01, np.pi),),
    (ActuatorGain("voltage", 1.0),), (ActuatorGain("voltage", -0.8),),
]  # fmt: skip


@functools.cache
def log(effects=(), seed=0, dt=0.02, start=0.3, most=2.0):
    """A pendulum swinging about its lowest point, driven either way."""
    rng = np.random.default_rng(seed)
    simulator = PendulumEquation(dt=dt)
    volts = np.repeat(rng.uniform(-most, most, (1, 40, 1)), 20, axis=1)
    first = np.array([[np.pi + start, 0.0]])
    states = simulator.with_effects(list(effects)).rollout(first, volts)[0]
    states += np.array([0.003, 0.03]) * rng.standard_normal(states.shape)
    return Trajectory("run", dt * np.arange(len(states)), states, volts[0])


def changes(run):
    simulator = PendulumEquation(dt=0.02)
    found = otherwise(simulator, prepare(simulator, [run], 0.5).fitter)
    return () if found is None else found.changes


@pytest.mark.parametrize("effects", LARGE)
def test_a_large_gap_is_no_matter_of_convention(effects):
    assert not changes(log(effects))


@pytest.mark.parametrize("effects", [(), (CoulombFriction("pivot", 0.003),)])
def test_a_reversed_input_is_told(effects):
    run = log(effects)
    told = changes(dataclasses.replace(run, actions=-run.actions))
    assert "`scale: -1` for voltage" in told


@pytest.mark.parametrize(
    "effects", [(), pytest.param((CoulombFriction("pivot", 1e-3),), marks=pytest.mark.long)]
)
def test_a_reversed_input_is_told_where_it_is_swung_by(effects):
    """The nominal simulator's forecasts are not poor: most of the motion is a free swing's."""
    run = log(effects, start=1.0, most=0.7)
    told = changes(dataclasses.replace(run, actions=-run.actions))
    assert told == ("`scale: -1` for voltage", "`scale: -1` for angle and rate")
    assert not changes(run)


@pytest.mark.parametrize(("offset", "wanted"), [
    (np.pi, "3.14159"), (-np.pi / 2, "1.5708"), (np.pi / 2, "-1.5708"),
])  # fmt: skip
def test_an_angle_counted_from_elsewhere_is_told(offset, wanted):
    run = log()
    (says,) = changes(dataclasses.replace(run, states=run.states + np.array([offset, 0.0])))
    assert f"`offset: {wanted}` for angle" in says


def test_a_joint_that_counts_the_other_way_round_is_told():
    """Only the gravity of a sideways zero tells it from a reversed input."""
    run = log()
    turned = dataclasses.replace(run, states=np.array([-1.0, -1.0]) * run.states)
    assert "`scale: -1` for angle and rate" in changes(turned)


@pytest.mark.parametrize(("factors", "volts", "wanted"), [
    ((180 / np.pi, 180 / np.pi), 1.0,
     "`unit: deg` for angle and `unit: deg/s` for rate (`scale: 0.0174533` if a unit is stated)"),
    ((1.0, 1.0), 1000.0, "`unit: mV` for voltage (`scale: 0.001` if a unit is stated)"),
])  # fmt: skip
def test_another_unit_is_told(factors, volts, wanted):
    run = log((CoulombFriction("pivot", 0.003),))
    (says,) = changes(
        dataclasses.replace(run, states=np.array(factors) * run.states, actions=volts * run.actions)
    )
    assert wanted in says


def test_zeros_on_which_nothing_depends_are_no_other_convention():
    """Of a wheel that is turned, without gravity, the other sign alone is asked after."""
    simulator = PendulumEquation(dt=0.02).with_parameters(gravity=0.0)
    volts = np.repeat(np.random.default_rng(0).uniform(-2, 2, (1, 40, 1)), 20, axis=1)
    states = simulator.rollout(np.array([[0.3, 0.0]]), volts)[0]
    run = Trajectory("wheel", 0.02 * np.arange(len(states)), states, -volts[0])
    found = otherwise(simulator, prepare(simulator, [run], 0.5).fitter)
    assert found is not None
    assert set(found.changes) == {"`scale: -1` for voltage", "`scale: -1` for angle and rate"}


@pytest.mark.long
@pytest.mark.parametrize("factor", [-1.0, 1000.0])
def test_nothing_is_certain_before_it_is_seen_how_the_log_counts(factor):
    run = log((CoulombFriction("pivot", 0.003),))
    offered = ["coulomb_friction@pivot"]
    wrong = dataclasses.replace(run, actions=factor * run.actions)
    free = dataclasses.replace(PendulumEquation.action_channels[0], low=-np.inf, high=np.inf)
    simulator = PendulumEquation(dt=0.02)
    simulator.action_channels = (free,)
    found = find_gap(simulator, [wrong], effects=offered, minutes=0.5)
    named = [v for v in found.verdicts if v.kind in ("confirmed", "ambiguous")]
    assert found.conventions is not None
    assert named
    assert all("conventions" in v.doubts and v.kind == "ambiguous" for v in named)


class Lift(EquationOfMotion):
    """A height by an accelerometer."""

    dt = 0.1
    state_channels = (
        Channel("height", "m", "position", scale=100.0),
        Channel("climb", "m/s", "rate", rate_of="height", scale=10.0),
    )
    action_channels = (Channel("accelerometer", "m/s2", "input", scale=1.0),)

    def acceleration(self, q, v, u, force, p):
        return u + force


def test_a_unit_that_only_makes_an_input_vanish_is_none():
    """An accelerometer's bias throws forecasts far off, and to go straight on is better."""
    rng = np.random.default_rng(0)
    felt = np.repeat(0.05 * rng.standard_normal((1, 40, 1)), 20, axis=1)
    simulator = Lift()
    states = simulator.rollout(np.array([[1000.0, 10.0]]), felt)[0]
    states += np.array([0.5, np.nan]) * rng.standard_normal(states.shape)
    run = Trajectory("lift", 0.1 * np.arange(len(states)), states, felt[0] + 1.5)
    assert not otherwise(simulator, prepare(simulator, [run], 10.0).fitter)


class Hoist(EquationOfMotion):
    """A motor that lifts a load, which is logged as an input."""

    dt = 0.01
    state_channels = (
        Channel("angle", "rad", "position"),
        Channel("rate", "rad/s", "rate", rate_of="angle", scale=5.0),
    )
    action_channels = (
        Channel("current", "A", "input"),
        Channel("load", "kg", "input", scale=0.5, low=0.0),
    )

    def acceleration(self, q, v, u, force, p):
        pull = 0.3 * u[:, 0] - 0.3 * u[:, 1]
        return ((pull + force[:, 0]) / 0.01)[:, None]


@pytest.mark.parametrize(
    ("loads", "changes"), [((200.0, 500.0), ("`unit: g` for load",)), ((0.2, 30.0), None)]
)
def test_an_input_far_beyond_its_scale_may_be_in_another_unit(loads, changes):
    """The current is far beyond one, but nothing says that it should not be."""
    currents = np.linspace(0, 900, 50)
    runs = [
        Trajectory(f"{load}", 0.01 * np.arange(51), np.cumsum(np.ones((51, 2)), axis=0),
                   np.column_stack([currents, np.full(50, load)]))
        for load in loads
    ]  # fmt: skip
    found = beyond_scale(Hoist(), Samples.join(runs, 1))
    assert (found and found.changes) == changes
    assert found is None or (found.reason, found.times) == ("scale", pytest.approx(1000.0))


def test_what_is_explained_does_not_hang_by_a_zero():
    """An upright pendulum in a loop runs away in forecasts, and would err less if it hung."""
    run = log()
    turned = dataclasses.replace(run, states=run.states + np.array([np.pi, 0.0]))
    simulator = PendulumEquation(dt=0.02)
    fitter = prepare(simulator, [turned], 0.5).fitter
    told, samples = otherwise(simulator, fitter), fitter.samples
    assert told is not None and told.reason == "zero"
    friction, offset = CoulombFriction("pivot", 0.01), SensorOffset("angle", np.pi)
    assert still_open(told, simulator, False, [friction], 9.0)
    assert still_open(told, simulator, True, [offset], 9.0)
    assert not still_open(told, simulator, True, [friction, SensorScale("angle", 0.01)], 4000.0)
    assert not still_open(told, simulator, True, [SensorOffset("angle", 0.01)], 4000.0)
    # Where another zero does nearly as much as all that was found, that makes up for the zero.
    assert still_open(told, simulator, True, [friction], 2.0 * told.times)
    # Two or three times better is what runs away would be if it hung, whatever was found.
    less = dataclasses.replace(told, times=2.7)
    assert not still_open(less, simulator, True, [friction], 4.0)
    assert not still_open(less, simulator, True, [], 1.0)
    # With its direction it is a zero, too; a direction alone is none.
    kinds = {one.says: one.turned for one in conventions(simulator, samples, {})}
    zeros = {says for says, turned in kinds.items() if turned}
    assert "`offset: 3.14159` and `scale: -1` for angle and rate" in zeros
    assert "`scale: -1` for angle and rate" not in zeros and "`scale: -1` for voltage" not in zeros
    # A unit that is wrong is made up for by a gain, down to the noise.
    mistaken = Conventions(("`unit: mV` for voltage",), 9.0)
    assert still_open(mistaken, simulator, True, [friction], 9.0)


class TwoRooms(FirstOrderSystem):
    dt = 10.0
    state_channels = (
        Channel("hall", "degC", "other", scale=20.0),
        Channel("attic", "degC", "other", scale=20.0),
    )
    action_channels = (Channel("heater", "W", "input", low=0.0, high=2000.0),)

    def derivative(self, x, u, p):
        hall, attic = x[:, 0], x[:, 1]
        return np.stack(
            [u[:, 0] / 9e4 - (hall - attic) / 900.0, (hall - attic) / 600.0 - (attic - 5.0) / 2e3],
            axis=1,
        )


def rooms():
    rng = np.random.default_rng(3)
    power = np.repeat(rng.uniform(0, 2000, 12), 25)[:, None]
    states = TwoRooms().rollout(np.array([12.0, 8.0]), power)
    states = states + rng.normal(0, 0.05, states.shape)
    return Trajectory("run", 10.0 * np.arange(301), states, power)


def test_all_temperatures_in_kelvin_are_asked_about_together():
    run = rooms()
    simulator = TwoRooms()
    kelvin = dataclasses.replace(run, states=run.states + 273.15)
    told = otherwise(simulator, prepare(simulator, [kelvin], 200.0).fitter)
    assert told is not None and "`unit: K` for hall" in told.changes[0]
    assert "`unit: K` for attic" in told.changes[0] and len(told.changes) == 1
    assert otherwise(simulator, prepare(simulator, [run], 200.0).fitter) is None


@pytest.mark.parametrize(("factor", "asked"), [(100.0, True), (1.0, False), (30.0, False)])
def test_a_state_far_beyond_its_scale_is_asked_about(factor, asked):
    """A position in cm under m may be forecast well by what gravity in cm would be."""
    times = 0.05 * np.arange(101)
    place = factor * (0.5 + 0.4 * np.sin(2 * times))
    states = np.stack([place, np.full(101, np.nan)], axis=1)
    run = Trajectory("run", times, states, np.zeros((100, 0)))
    found = beyond_scale(Cart(), Samples.join([run], 1))
    assert (found is not None and "`unit: cm` for x" in found.changes) == asked


class Servo(FirstOrderSystem):
    dt = 0.05
    state_channels = (Channel("angle", "deg", "other", scale=90.0),)
    action_channels = ()

    def derivative(self, x, u, p):
        return -x


@pytest.mark.parametrize("converted", [{}, {"angle": "rad"}])
def test_degrees_that_were_taken_for_radians_are_asked_about_first(converted):
    """Where nothing was converted, another unit is all that is left to ask about."""
    angle = np.degrees(90.0 + 80.0 * np.sin(0.1 * np.arange(101)))
    run = Trajectory("run", 0.05 * np.arange(101), angle[:, None], np.zeros((100, 0)))
    found = beyond_scale(Servo(), Samples.join([run], 1), converted)
    first = "`unit: deg` for angle (not rad)" if converted else "`unit: mrad` for angle"
    assert found.changes[0] == first


class Cart(EquationOfMotion):
    dt = 0.05
    state_channels = (
        Channel("x", "m", "position", scale=0.5),
        Channel("v", "m/s", "rate", rate_of="x", scale=0.5),
    )
    action_channels = ()

    def acceleration(self, q, v, u, force, p):
        return force - 0.2
