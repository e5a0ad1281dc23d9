"""Logs whose times are ten or sixty times too long, or too short, or made up."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from plate import Plate

from residual.gap import find_gap
from residual.gap.preparation.conventions import otherwise, still_open
from residual.gap.preparation.prepare import prepare
from residual.trajectories import Trajectory
from sims.effects import ActuatorGain, ConstantLoad, ParameterChange

#: What a plate may lack that is none of its clock.
LARGE = [
    (), (ParameterChange("time_constant", 60.0),), (ParameterChange("time_constant", -15.0),),
    (ConstantLoad("warmth", 0.5),),
]  # fmt: skip


def heated(effects=(), dt=1.0):
    rng = np.random.default_rng(1)
    power = np.repeat(rng.uniform(0.0, 1.0, 16), 25)
    plate = Plate(dt=dt).with_effects(list(effects))
    states = plate.rollout(np.zeros((1, 1)), power[None, :, None])[0]
    states += 0.05 * rng.standard_normal(states.shape)
    return Trajectory("run", dt * np.arange(len(states)), states, power[:, None])


def asked(run, dt=1.0):
    plate = Plate(dt=dt)
    return otherwise(plate, prepare(plate, [run], 25.0 * float(run.durations[0])).fitter)


@pytest.mark.parametrize("slip", [10.0, 0.1, 60.0])
def test_a_slip_of_the_clock_is_told(slip):
    run = heated()
    found = asked(dataclasses.replace(run, times=slip * run.times))
    assert found is not None
    (says,) = found.changes
    assert says == f"`scale: {1 / slip:.6g}` for the time (`period: 1` of a log without times)"


@pytest.mark.parametrize("pace", [2.5, 0.4])
def test_times_that_were_made_up_are_told_unless_one_parameter_explains_as_much(pace):
    run = heated()
    found = asked(dataclasses.replace(run, times=pace * run.times))
    assert found is not None and found.reason == "pace"
    assert found.changes[0].startswith(f"`scale: {1 / pace:.6g}` for the time")
    off = ParameterChange("time_constant", 30.0)
    assert not still_open(found, Plate(), True, [off, ConstantLoad("warmth", 0.1)], 20.0)
    assert still_open(found, Plate(), True, [off, ActuatorGain("power", 0.3)], 20.0)


def test_numbers_of_rows_in_place_of_times_are_told():
    run = heated(dt=0.2)
    found = asked(dataclasses.replace(run, times=np.arange(len(run.times), dtype=float)), dt=0.2)
    assert found is not None
    assert found.changes[0].startswith("`scale: 0.2` for the time")


def test_a_sample_a_second_of_a_faster_simulator_is_none():
    assert asked(heated(dt=1.0), dt=0.2) is None


@pytest.mark.parametrize("effects", LARGE)
def test_rare_and_frequent_samples_are_none(effects):
    run = heated(effects)
    assert asked(run) is None
    for dt in (0.1, 0.7, 1.25, 10.0):
        assert asked(run, dt) is None, dt


@pytest.mark.long
def test_nothing_is_certain_before_the_clock_is_seen_to():
    run = heated((ParameterChange("time_constant", 6.0),))
    found = find_gap(Plate(), [dataclasses.replace(run, times=10.0 * run.times)], minutes=0.5)
    assert found.conventions is not None
    assert "`scale: 0.1` for the time" in found.conventions.changes[0]
    assert all(v.kind == "ambiguous" for v in found.verdicts if v.effect)


@pytest.mark.parametrize("unit", [1000.0, 1 / 60])
def test_another_unit_of_time_is_told_where_rows_do_not_come_at_the_control_period(unit):
    """Milliseconds said of seconds, or seconds of minutes."""
    run = heated()
    run = dataclasses.replace(run, times=run.times / unit)
    found = asked(run, dt=0.4)
    assert found is not None and found.changes == (f"`scale: {unit:.6g}` for the time",)
