"""Columns of a room that a log has otherwise: kelvin, Fahrenheit, thousandths, upside down."""

from __future__ import annotations

import dataclasses
from typing import ClassVar

import numpy as np
import pytest

from residual.gap.preparation.conventions import otherwise
from residual.gap.preparation.other_units import misread
from residual.gap.preparation.prepare import prepare
from residual.logs import read_logs
from residual.trajectories import Trajectory
from sims.effects import ActuatorGain, ParameterChange
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter


class Room(FirstOrderSystem):
    """A room warmed by a heater, losing heat to the cold outside."""

    dt = 10.0
    state_channels = (Channel("room", "K", "other", scale=10.0),)
    action_channels = (Channel("heater", "W", "input", scale=1000.0, low=0.0, high=3000.0),)
    parameters: ClassVar = {
        "capacity": Parameter(5e4, "J/K", "heat that warms the room by 1 K"),
        "loss": Parameter(40.0, "W/K", "loss to the outside"),
        "outside": Parameter(270.0, "K", "temperature outside"),
    }

    def derivative(self, x, u, p):
        return (u - p.loss * (x - p.outside)) / p.capacity


def test_degrees_celsius_are_no_kelvin():
    rng = np.random.default_rng(0)
    watts = np.repeat(rng.uniform(0.0, 3000.0, (1, 20, 1)), 30, axis=1)
    simulator = Room()
    warm = simulator.rollout(np.array([[293.0]]), watts)[0]
    warm += 0.1 * rng.standard_normal(warm.shape)
    for zero, wanted in (
        (0.0, None),
        (273.15, ("`unit: degC` for room (`offset: 273.15` if a unit is stated)",)),
    ):
        run = Trajectory("room", 10.0 * np.arange(len(warm)), warm - zero, watts[0])
        found = otherwise(simulator, prepare(simulator, [run], 300.0).fitter)
        assert (found and found.changes) == wanted


def test_a_share_of_the_largest_command_is_told():
    rng = np.random.default_rng(0)
    watts = np.repeat(rng.uniform(0.0, 3000.0, (1, 20, 1)), 30, axis=1)
    warm = Room().rollout(np.array([[293.0]]), watts)[0]
    warm += 0.1 * rng.standard_normal(warm.shape)
    run = Trajectory("room", 10.0 * np.arange(len(warm)), warm, watts[0] / 3000.0)
    found = otherwise(Room(), prepare(Room(), [run], 300.0).fitter)
    assert found is not None
    assert found.changes == ("`scale: 3000` for heater",)


def test_a_relay_that_is_on_at_zero_is_told():
    rng = np.random.default_rng(0)
    watts = np.repeat(rng.uniform(0.0, 3000.0, (1, 20, 1)), 30, axis=1)
    warm = Room().rollout(np.array([[293.0]]), watts)[0]
    warm += 0.1 * rng.standard_normal(warm.shape)
    run = Trajectory("room", 10.0 * np.arange(len(warm)), warm, 3000.0 - watts[0])
    found = otherwise(Room(), prepare(Room(), [run], 300.0).fitter)
    assert found is not None
    assert found.changes == ("`scale: -1` and `offset: 3000` for heater",)


def test_degrees_that_a_header_calls_kelvin_are_told():
    """Also where the nominal simulator forecasts poorly with the right unit."""
    rng = np.random.default_rng(0)
    watts = np.repeat(rng.uniform(0.0, 3000.0, (1, 20, 1)), 30, axis=1)
    warm = Room().with_effects([ActuatorGain("heater", -0.3)]).rollout(np.array([[293.0]]), watts)
    read = warm[0] + 0.1 * rng.standard_normal(warm[0].shape) - 273.15
    run = Trajectory("room", 10.0 * np.arange(len(read)), read - 273.15, watts[0])

    class InDegrees(Room):
        state_channels = (Channel("room", "degC", "other", scale=10.0),)
        parameters = Room.parameters | {"outside": Parameter(-3.15, "degC", "outside")}

    fitter = prepare(InDegrees(), [run], 300.0).fitter
    found = otherwise(InDegrees(), fitter, {"room": "K"})
    assert found is not None
    assert found.changes == ("`unit: degC` for room (not K)",)
    # What was not converted was not converted by mistake.
    plain = otherwise(InDegrees(), fitter)
    assert plain is None or "not K" not in str(plain.changes)
    right = dataclasses.replace(run, states=read)
    assert otherwise(InDegrees(), prepare(InDegrees(), [right], 300.0).fitter) is None


class Yard(Room):
    """A room whose outside is measured."""

    state_channels = (Channel("room", "degC", "other", scale=10.0),)
    action_channels = (*Room.action_channels, Channel("outside", "degC", "input", scale=10.0))
    parameters: ClassVar = {name: Room.parameters[name] for name in ("capacity", "loss")}

    def derivative(self, x, u, p):
        return (u[:, :1] - p.loss * (x - u[:, 1:])) / p.capacity


def test_degrees_fahrenheit_of_an_input_are_told_of_that_column(tmp_path):
    rng = np.random.default_rng(0)
    watts = np.repeat(rng.uniform(0.0, 3000.0, 20), 30)
    outside = 8.0 + np.cumsum(0.05 * rng.standard_normal(600))
    weak = Yard(effects=[ParameterChange("loss", 10.0)])
    warm = weak.rollout([12.0], np.column_stack([watts, outside]))[:-1, 0]
    warm += 0.1 * rng.standard_normal(600)
    columns = [10.0 * np.arange(600), warm, watts, 1.8 * outside + 32.0]
    for header, zero, unit in (("room", 0.0, ""), ("room [K]", 273.15, "K")):
        path = tmp_path / f"log{unit}.csv"
        table = np.column_stack([columns[0], warm + zero, *columns[2:]])
        np.savetxt(path, table, delimiter=",", comments="", header=f"time,{header},heater,outside")
        read = read_logs(path, Yard.state_channels, Yard.action_channels).trajectories
        assert read[0].converted == ({"room": "K"} if unit else {})
        found = otherwise(Yard(), prepare(Yard(), read, 600.0).fitter, read[0].converted)
        assert found is not None
        assert found.changes[0].startswith("`unit: degF` for outside")


def test_thousandths_are_told_of_any_unit():
    rng = np.random.default_rng(0)
    watts = np.repeat(rng.uniform(0.0, 3000.0, (1, 20, 1)), 30, axis=1)
    warm = Room().rollout(np.array([[293.0]]), watts)[0]
    warm += 0.1 * rng.standard_normal(warm.shape)
    run = Trajectory("room", 10.0 * np.arange(len(warm)), 1000.0 * warm, watts[0])
    found = otherwise(Room(), prepare(Room(), [run], 300.0).fitter)
    assert found is not None
    assert found.changes == ("`unit: mK` for room (`scale: 0.001` if a unit is stated)",)


def test_a_turned_sign_of_any_channel_is_told():
    rng = np.random.default_rng(0)
    watts = np.repeat(rng.uniform(0.0, 3000.0, (1, 20, 1)), 30, axis=1)
    warm = Room().rollout(np.array([[293.0]]), watts)[0]
    warm += 0.1 * rng.standard_normal(warm.shape)
    run = Trajectory("room", 10.0 * np.arange(len(warm)), -warm, watts[0])
    found = otherwise(Room(), prepare(Room(), [run], 300.0).fitter)
    assert found is not None
    assert "`scale: -1` for room" in found.changes


class Thermometer(FirstOrderSystem):
    """It is taken to be much quicker than it is."""

    dt = 0.25
    state_channels = (Channel("reading", "degC", "other", scale=5.0),)
    action_channels = (Channel("water", "degC", "input", scale=5.0),)
    parameters: ClassVar = {"lag": Parameter(2.0, "s", "of the thermometer", low=0.1)}

    def derivative(self, x, u, p):
        return (u - x) / p.lag


@pytest.mark.parametrize(
    ("reading", "water", "wanted"),
    [((1.0, 0.0), (1.0, 0.0), None), ((1.0, 273.15), (1.0, 0.0), "`unit: K` for reading"),
     ((1.0, 0.0), (1.8, 32.0), "`unit: degF` for water")],
)  # fmt: skip
def test_another_zero_is_told_beside_a_simulator_that_is_poor_in_any_unit(reading, water, wanted):
    """All that the thermometer does in a window is little beside what it is taken to do."""
    hot = 85.0 + 10.0 * np.repeat(np.random.default_rng(0).uniform(0, 1, 30), 8)
    warm = [88.0]
    for one in hot:
        warm.append(one + (warm[-1] - one) * np.exp(-0.25 / 20.0))
    states = (reading[0] * np.array(warm) + reading[1])[:, None]
    actions = (water[0] * hot + water[1])[:, None]
    run = Trajectory("run", 0.25 * np.arange(len(states)), states, actions)
    found = otherwise(Thermometer(), prepare(Thermometer(), [run], 4.0).fitter)
    assert (found is None) if wanted is None else found.changes[0].startswith(wanted)


class Carbon(FirstOrderSystem):
    """What is emitted stays in the air."""

    dt = 1.0
    state_channels = (Channel("carbon", "1", "other", scale=50.0),)
    action_channels = (Channel("emitted", "1", "input", scale=5.0, low=0.0),)

    def derivative(self, x, u, p):
        return u / 2.0


def test_thousands_of_what_has_no_unit_are_told_and_no_sign_that_bounds_cut_off():
    emitted = np.linspace(2.0, 9.0, 60) + np.random.default_rng(0).uniform(-0.5, 0.5, 60)
    carbon = 300.0 + np.append(0.0, np.cumsum(emitted)) / 2.0
    for factor, wanted in ((1.0, None), (1000.0, ("`scale: 0.001` for emitted",))):
        run = Trajectory("air", np.arange(61.0), carbon[:, None], factor * emitted[:, None])
        found = otherwise(Carbon(), prepare(Carbon(), [run], 6.0).fitter)
        assert (found and found.changes) == wanted


def test_only_the_unit_that_a_header_states_may_be_the_wrong_one():
    height = Channel("height", "m", "other", scale=1.0)
    assert misread(height, {"height": "ft"})[0][0] == "`unit: m` for height (not ft)"
    assert misread(height, {"height": "mm"}) == []  # a thousand times more is km as well
    assert misread(height, {}) == []
