"""What grows steadily along a record, as a room that warms, passes for an effect no longer."""

import dataclasses
import functools
from typing import ClassVar

import numpy as np
import pytest
from oven import SLOW, Oven, steps

from residual.gap import find_gap
from residual.gap.confirmation.drift import _records
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter

DUTIES = [float(duty) for duty in np.random.default_rng(3).integers(0, 2, 25)]


def warmed(run, by):
    """The record in a room that warms steadily, by so many K in all (closed form)."""
    rate = by / run.times[-1]
    more = rate * (run.times - SLOW * (1 - np.exp(-run.times / SLOW)))
    return dataclasses.replace(run, states=run.states + more[:, None])


def named(run, **options):
    return [v for v in find_gap(Oven(), [run], **options).verdicts if v.parameters]


@functools.cache
def in_a_room_that_warms(by):
    return named(warmed(steps(0, DUTIES, 0.0, lag=0.0), by))


@pytest.mark.long
@pytest.mark.parametrize("by", [1.0, 3.0])
def test_a_room_that_warms_has_no_name_that_is_certain(by):
    found = in_a_room_that_warms(by)
    assert not [verdict.label for verdict in found if verdict.kind == "confirmed"]


@pytest.mark.long
def test_what_is_there_in_a_room_that_warms_stays_certain():
    offered = ("actuator_lag", "delay", "actuator_gain", "constant_load", "second_store", "slow")
    found = named(warmed(steps(0, DUTIES, 0.0, lag=8.0), 1.0), effects=offered)
    assert "actuator_lag@duty" in [v.label for v in found if v.kind == "confirmed"]
    assert not [v.label for v in found if v.kind == "confirmed" and v.effect != "actuator_lag"]


@pytest.mark.long
def test_a_gain_in_a_room_that_stays_as_it_is_is_certain():
    duties = np.random.default_rng(3).uniform(0.0, 0.9, 25)
    run = steps(0, list(duties), 0.0, lag=0.0)
    actions = run.actions / 0.9
    (gain,) = named(dataclasses.replace(run, actions=actions))
    assert (gain.kind, gain.doubts) == ("confirmed", ())
    assert gain.parameters["gain"].value == pytest.approx(-0.1, abs=5e-3)


@pytest.mark.long
def test_no_number_of_what_is_certain_lies_at_its_bound():
    """A store so slow that it is a ramp."""
    found = in_a_room_that_warms(1.0)
    bound = [v for v in found if any(n.at_bound for n in v.parameters.values())]
    assert all("at_bound" in verdict.doubts for verdict in bound)


class Falling(FirstOrderSystem):
    """A body that falls in a vacuum."""

    dt = 0.02
    state_channels = (Channel("speed", "m/s", "rate", scale=5.0),)
    action_channels = ()
    parameters: ClassVar = {"gravity": Parameter(9.81, "m/s^2", "free fall")}

    def derivative(self, x, u, p):
        return (p.gravity + 0.0 * x[:, 0])[:, None]


def test_what_grows_alike_in_every_record_is_no_drift():
    """Drag on falling bodies that tumble, in closed form, each let go at a speed of its own."""
    rng = np.random.default_rng(0)
    times = 0.02 * np.arange(40)
    drops = []
    for number, start in enumerate(rng.uniform(0.0, 2.0, 8)):
        drag = 0.04 * rng.uniform(0.5, 1.5)
        last = np.sqrt(9.81 / drag)
        speed = last * np.tanh(np.sqrt(9.81 * drag) * times + np.arctanh(start / last))
        seen = speed + rng.normal(0, 0.02, len(times))
        drops.append(Trajectory(f"drop {number}", times, seen[:, None], np.zeros((39, 0))))
    offered = ("quadratic_drag", "viscous_friction", "coulomb_friction", "gravity")
    found = find_gap(Falling(), drops, effects=offered)
    (named,) = [v for v in found.verdicts if v.parameters]
    assert (named.kind, named.doubts) == ("confirmed", ())
    assert "quadratic_drag" in (named.effect, *(form.split("@")[0] for form in named.form))


@pytest.mark.parametrize(("records", "left"), [(1, 0.0), (2, 0.0), (3, 1.0), (5, 1.0)])
def test_of_three_records_what_grows_alike_in_all_is_left(records, left):
    columns = _records(np.arange(records))[:, 0]
    alike = np.ones(records)
    by_columns = columns @ np.linalg.lstsq(columns, alike, rcond=None)[0]
    np.testing.assert_allclose(alike - by_columns, left, atol=1e-12)


class Car(FirstOrderSystem):
    """Speed by traction, without the drag of the air."""

    dt = 0.1
    state_channels = (Channel("speed", "m/s", "rate", scale=15.0),)
    action_channels = (Channel("traction", "N", "input", scale=2000.0),)
    parameters: ClassVar = {
        "mass": Parameter(1200.0, "kg", "mass", low=10.0),
        "roll": Parameter(0.12, "m/s^2", "rolling resistance", low=0.0),
    }

    def derivative(self, x, u, p):
        return (u[:, 0] / p.mass - p.roll)[:, None]


def driven(seed, wind, n=1800, drag=3.5e-4):
    """A drive against a head wind that rises steadily from none, by Euler in 10 ms."""
    rng = np.random.default_rng(seed)
    traction = np.repeat(rng.uniform(-300, 2500, n // 60), 60)
    speed, seen = 8.0, []
    for k in range(n):
        seen.append(speed)
        for part in range(10):
            air = speed + wind * (k + part / 10) / n
            speed += 0.01 * (traction[k] / 1200 - 0.12 - drag * air * abs(air))
    times = 0.1 * np.arange(n)
    states = np.array(seen)[:, None] + 0.05 * rng.standard_normal((n, 1))
    return Trajectory(f"drive {seed}", times, states, traction[:-1, None])


@pytest.mark.long
def test_the_size_of_drag_holds_beside_a_wind_that_rises():
    asked = ("quadratic_drag", "viscous_friction", "constant_load", "actuator_gain", "mass", "roll")
    found = find_gap(Car(), [driven(seed, wind=8.0) for seed in (0, 1)], effects=asked)
    drags = [v for v in found.verdicts if v.effect == "quadratic_drag"]
    assert drags
    for verdict in drags:
        (size,) = verdict.parameters.values()
        assert size.low < 3.5e-4 < size.high
    (calm,) = [
        v
        for v in find_gap(
            Car(), [driven(seed, wind=0.0) for seed in (0, 1)], effects=asked
        ).verdicts
        if v.effect == "quadratic_drag"
    ]
    (size,) = calm.parameters.values()
    assert calm.kind == "confirmed" and size.low < 3.5e-4 < size.high < 4.2e-4
