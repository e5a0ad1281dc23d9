"""Two laws of an actuator are certain only where the input rests at more levels than they need."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from residual.gap import find_gap
from residual.gap.confirmation.few_levels import resting_levels
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.simulator import Channel

DT, GAIN, LAG = 0.05, 70.0, 0.4


class Lamp(FirstOrderSystem):
    dt = DT
    state_channels = (Channel("light", "lx", "other", scale=30.0),)
    action_channels = (Channel("duty", "1", "input", low=0.0, high=1.0),)
    parameters = {}

    def derivative(self, x, u, p):
        return (GAIN * u - x) / LAG


def record(seed, duties):
    """A lamp that gives more light, and none up to a tenth; its driver's clock is not the log's."""
    rng = np.random.default_rng(seed)
    duty = np.repeat(rng.permutation(duties), 30) + 1e-3 * rng.standard_normal(30 * len(duties))
    light, seen = 0.0, []
    for u in duty:
        seen.append(light)
        goal = 1.25 * GAIN * max(u - 0.1, 0.0)
        light = goal + (light - goal) * np.exp(-DT / LAG)
    seen = np.array(seen) + 0.05 * rng.standard_normal(len(seen))
    return Trajectory(f"run {seed}", DT * np.arange(len(seen)), seen[:, None], duty[:-1, None])


ASKED = ("actuator_gain", "dead_zone", "quadratic_actuator", "saturation", "delay")


@pytest.mark.parametrize(("duties", "sure"), [
    pytest.param((0.25, 0.6), False, marks=pytest.mark.long, id="2"),
    pytest.param((0.2, 0.35, 0.5, 0.7, 0.9), True, id="5"),
])  # fmt: skip
def test_a_dead_zone_and_a_gain_need_three_levels(duties, sure):
    found = find_gap(Lamp(), [record(seed, 4 * duties) for seed in (1, 2)], effects=ASKED)
    laws = [v for v in found.verdicts if v.effect in ASKED[:4]]
    assert len(laws) == 2
    for law in laws:
        assert (law.kind == "confirmed") == sure
        assert ("levels" in law.doubts) == (not sure)
    if sure:
        assert {law.effect for law in laws} == {"actuator_gain", "dead_zone"}


class Wheel(FirstOrderSystem):
    """A wheel that a motor turns both ways."""

    dt = DT
    state_channels = (Channel("speed", "rad/s", "rate", scale=5.0),)
    action_channels = (Channel("duty", "1", "input", low=-1.0, high=1.0),)
    parameters = {}

    def derivative(self, x, u, p):
        return (20.0 * u - x) / LAG


@pytest.mark.parametrize(("duties", "sure"), [
    ((-0.3, 0.3), False), pytest.param((-0.3, 0.0, 0.3), True, marks=pytest.mark.long),
])  # fmt: skip
def test_a_push_is_a_gain_that_differs_by_direction_where_the_input_has_two_levels(duties, sure):
    rng = np.random.default_rng(4)
    duty, speed, seen = np.repeat(rng.permutation(8 * duties), 25), 0.0, []
    for u in duty:
        seen.append(speed)
        goal = 20.0 * u + 0.4
        speed = goal + (speed - goal) * np.exp(-DT / LAG)
    seen = np.array(seen) + 0.05 * rng.standard_normal(len(seen))
    run = Trajectory("run", DT * np.arange(len(seen)), seen[:, None], duty[:-1, None])
    found = find_gap(Wheel(), [run])
    pushes = ("constant_load", "actuator_bias", "sensor_offset")
    (push,) = (v for v in found.verdicts if v.effect in pushes and v.parameters)
    assert (push.kind == "confirmed") == sure
    assert ("levels" in push.doubts) == (not sure)


@settings(max_examples=40, deadline=None)
@given(
    places=st.sets(st.integers(0, 9), min_size=1, max_size=5),
    seed=st.integers(0, 99),
    size=st.sampled_from([0.01, 1.0, 300.0]),
)
def test_levels_are_counted_in_any_order_and_unit(places, seed, size):
    rng = np.random.default_rng(seed)
    values = np.repeat([1.0 + place for place in places], 50)
    values = rng.permutation(values + 0.002 * rng.standard_normal(len(values)))
    assert resting_levels(size * values) == len(places)


def test_what_takes_every_value_rests_at_none():
    assert resting_levels(np.linspace(0.1, 1.0, 300)) is None
    assert resting_levels(np.r_[np.full(200, 0.3), np.linspace(0.1, 1.0, 100)]) is None
    assert resting_levels(np.zeros(0)) is None
