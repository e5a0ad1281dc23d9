"""Columns in another unit than they are read in."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pan_head import Head, turning

from residual.gap.data.examine import findings
from residual.trajectories import Trajectory, moment
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter


def said(run, kind):
    return [one.says for one in findings(Head(), [run]) if one.kind == kind]


@given(seed=st.integers(0, 50), factor=st.floats(0.2, 3.0))
@settings(max_examples=25)
def test_sizes_of_about_what_is_declared_raise_no_question(seed, factor):
    run = turning(seed)
    run = dataclasses.replace(run, states=factor * run.states, actions=0.4 * factor * run.actions)
    assert not said(run, "size")


def test_a_column_in_radians_that_is_read_as_degrees_is_asked_after():
    run = turning()
    (says,) = said(dataclasses.replace(run, states=np.deg2rad(run.states) / 10), "size")
    assert "`unit: rad`" in says


def test_a_command_that_was_converted_once_too_often_is_asked_after():
    run = turning()
    for times in (35, 60):
        (says,) = said(dataclasses.replace(run, actions=run.actions / times), "size")
        assert "where 40 deg/s are declared" in says


class Oven(FirstOrderSystem):
    """An oven that is heated by up to its full power."""

    dt = 1.0
    state_channels = (Channel("above", "K", "other", scale=20.0),)
    action_channels = (Channel("power", "1", "input", low=0.0, high=100.0),)

    def derivative(self, x, u, p):
        return (0.5 * u - x) / 50.0


@pytest.mark.parametrize(("most", "asked"), [(0.7, True), (1.5, False)])
def test_an_input_that_would_be_beyond_its_bounds_is_in_no_other_unit(most, asked):
    power = np.repeat(np.linspace(0.0, most, 20), 15)[:, None]
    states = Oven().rollout(np.array([10.0]), power)
    run = Trajectory("run", np.arange(301.0), states, power)
    told = [one.where for one in findings(Oven(), [run]) if one.kind == "size"]
    assert ("power" in told) is asked


def test_times_of_a_calendar_are_told_with_their_date():
    assert moment(12.25) == "12.25 s"
    assert moment(1585250253.569) == "1585250253.57 s (2020-03-26 19:17:33.5 UTC)"
    assert moment(1e18) == "1e+18 s"
    assert moment(float("nan")) == "nan s"


class Plate(FirstOrderSystem):
    """A hot plate in a room."""

    dt = 1.0
    state_channels = (Channel("plate", "K", "other", scale=20.0),)
    action_channels = (Channel("power", "W", "input", scale=10.0),)

    def __init__(self, ambient=293.0):
        self.parameters = {"ambient": Parameter(ambient, "K", "room")}
        super().__init__()

    def derivative(self, x, u, p):
        return ((p.ambient + 2.0 * u[:, 0] - x[:, 0]) / 60.0)[:, None]


@pytest.mark.parametrize(
    ("zero", "ambient", "told"),
    [(0.0, 293.0, False), (273.15, 293.0, True), (273.15, 20.0, False), (0.0, 20.0, False)],
)
def test_a_temperature_of_another_zero_is_told(zero, ambient, told):
    """In degC as if in K: the room is then 253 K warmer than anything that was measured."""
    simulator = Plate(ambient)
    power = np.repeat(np.random.default_rng(0).uniform(0, 20, 10), 30)[:, None]
    path = Plate().rollout([300.0], power) - zero
    run = Trajectory("run", np.arange(301.0), path, power)
    says = [one.says for one in findings(simulator, [run]) if "warmer" in one.says]
    assert bool(says) is told
    assert not told or "set `unit: degC`" in says[0]


@pytest.mark.parametrize(
    ("ambient", "told"), [(20.0, False), (293.15, True), (900.0, False), (200.0, False)]
)
def test_a_room_in_kelvin_beside_degrees_is_told(ambient, told):
    class InDegrees(Plate):
        state_channels = (dataclasses.replace(Plate.state_channels[0], unit="degC"),)

        def __init__(self, ambient):
            super().__init__(ambient)
            self.parameters = self.parameters | {"ambient": Parameter(ambient, "degC", "room")}

    power = np.repeat(np.random.default_rng(0).uniform(0, 20, 10), 30)[:, None]
    run = Trajectory("run", np.arange(301.0), Plate().rollout([300.0], power) - 273.15, power)
    told_of = [one for one in findings(InDegrees(ambient), [run]) if "warmer" in one.says]
    assert bool(told_of) is told
    assert not told or (told_of[0].where == "ambient" and "it is 20 degC" in told_of[0].says)
