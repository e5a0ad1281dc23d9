"""Episodes in one record, times going on: cut where the state leaps, and nowhere else."""

from typing import ClassVar

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from residual.gap import find_gap
from residual.gap.data.resets import cut_at_resets, leapt
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.pendulum_equation import PendulumEquation
from sims.simulator import Channel, Parameter
from studies.hidden.data import Truth, make_logs

TIMES = np.arange(600) * 0.02


def motion(seed, size=1.0):
    rng = np.random.default_rng(seed)
    return size * sum(a * np.sin(w * TIMES + p) for a, w, p in rng.uniform(0.3, 3.0, (3, 3)))


def leaps(values, times=TIMES):
    return np.flatnonzero(leapt([values], [times])[0]).tolist()


@given(seed=st.integers(0, 999), row=st.integers(10, 580), noise=st.sampled_from([0.0, 0.01]))
def test_a_leap_is_found_in_the_row_where_it_is(seed, row, noise):
    moved = motion(seed) + noise * np.random.default_rng(seed).standard_normal(600)
    assert leaps(moved) == []
    moved[row:] += 1.5 * np.ptp(moved)
    assert leaps(moved) == [row - 1]


@given(seed=st.integers(0, 99), step=st.floats(0.01, 0.3), speed=st.floats(0.01, 5.0))
def test_neither_an_encoder_nor_a_rest_nor_a_start_is_a_leap(seed, step, speed):
    moved = motion(seed)
    assert leaps(np.round(moved / step) * step) == []
    moved[200:300] = moved[200]
    begun = np.concatenate([np.zeros(300), speed * TIMES[:300]])
    assert leaps(begun) == [] and leaps(np.round(begun / step) * step) == []


def test_what_comes_back_and_what_was_not_logged_is_no_leap():
    moved = motion(1)
    wild = moved.copy()
    wild[100] += 9.0
    lost = moved.copy()
    lost[200:220] = 0.0
    assert leaps(wild) == [] and leaps(lost) == []
    kept = np.delete(np.arange(600), slice(300, 304))
    assert leaps(moved[kept], TIMES[kept]) == []
    # It rose, and falls after a hole, as fast as elsewhere in as many rows.
    fell = np.append(moved[:300], moved[300:] - 8 * np.abs(np.diff(moved)).max())
    assert leaps(fell) == [299]
    assert leaps(fell, np.append(TIMES[:300], TIMES[300:] + 0.1)) == []
    unseen = moved.copy()
    unseen[50:60] = np.nan
    assert leaps(unseen) == []
    assert leaps(moved[:10], TIMES[:10]) == [] and leaps(moved[:1], TIMES[:1]) == []


@pytest.fixture(scope="module")
def episodes():
    """Eight swings of a heavier pendulum, one after the other in one record."""
    runs = make_logs(Truth(mass=0.3), 5, "strong", "A", runs=8)
    count, states = len(runs[0].times), np.zeros((0, 2))
    for run in runs:
        leap = states[-1, 0] + 2.0 - run.states[0, 0] if len(states) else 0.0
        states = np.concatenate([states, run.states + np.array([leap, 0.0])])
    acted = [np.concatenate([run.actions, run.actions[-1:]]) for run in runs]
    times = np.arange(8 * count) * float(np.median(runs[0].durations))
    return Trajectory("log.csv", times, states, np.concatenate(acted)[:-1]), count


def test_the_record_is_cut_and_told(episodes):
    record, count = episodes
    runs, (finding,) = cut_at_resets(PendulumEquation(), [record])
    assert len(runs) == 8 and finding.numbers["resets"] == 7
    assert [run.name for run in runs][:2] == ["log.csv part 1", "log.csv part 2"]
    assert {len(run.times) for run in runs} == {count}
    assert finding.says.startswith("log.csv begins anew 7 times, the first time at ")


def test_what_is_missing_is_named_as_in_records_of_their_own():
    runs = make_logs(Truth(mass=0.3), 5, "strong", "A", runs=4)
    acted = [np.concatenate([run.actions, run.actions[-1:]]) for run in runs]
    states = np.concatenate([run.states for run in runs])
    times = np.arange(len(states)) * float(np.median(runs[0].durations))
    record = Trajectory("log.csv", times, states, np.concatenate(acted)[:-1])
    found = find_gap(PendulumEquation(), [record], effects=["mass", "inertia"], hold="zero")
    (named,) = (v for v in found.verdicts if v.parameters)
    assert named.effect == "mass"
    assert named.parameters["change"].value == pytest.approx(0.3 * 0.055, rel=0.03)


class Kettle(FirstOrderSystem):
    """Water that is heated, and cools in ten minutes."""

    dt = 5.0
    state_channels = (Channel("water", "degC", "other", scale=50.0),)
    action_channels = (Channel("power", "W", "input", scale=1000.0, low=0.0, high=2000.0),)
    parameters: ClassVar = {"capacity": Parameter(4000.0, "J/K", "heat capacity", low=1.0)}

    def derivative(self, x, u, p):
        return np.stack([(u[:, 0] - 7.0 * (x[:, 0] - 20.0)) / p.capacity], axis=1)


def heated(seed, start, rows=150, noise=0.05):
    rng = np.random.default_rng(seed)
    power = np.repeat(rng.choice([0.0, 600.0, 1200.0, 2000.0], rows // 15), 15)
    simulator = Kettle()
    water = [np.array([start])]
    for u in power[:-1]:
        water.append(simulator.step(water[-1][None], np.array([[u]]))[0])
    return np.array(water)[:, 0] + noise * rng.standard_normal(rows), power


def joined(parts):
    water, power = (np.concatenate(column) for column in zip(*parts, strict=True))
    return Trajectory("log.csv", np.arange(len(water)) * 5.0, water[:, None], power[:-1, None])


@given(seed=st.integers(0, 99), second=st.floats(-1.0, 1.0))
@settings(max_examples=25)
def test_a_state_that_the_simulator_does_not_move_so_fast_begins_anew(seed, second):
    first = heated(seed, 20.0)
    runs, findings = cut_at_resets(Kettle(), [joined([first])])
    assert len(runs) == 1 and not findings
    start = first[0][-1] + np.copysign(30.0 + 30.0 * abs(second), second)
    runs, (finding,) = cut_at_resets(Kettle(), [joined([first, heated(seed + 1, start)])])
    assert [len(run.times) for run in runs] == [150, 150]
    assert finding.says.startswith("log.csv begins anew at 750 s without saying so: water leaps")


def test_a_number_that_stands_for_a_missing_reading_is_no_beginning():
    water, power = heated(3, 20.0)
    lost = np.array(water)
    for row in (20, 50, 51, 90, 91, 92, 120):
        lost[row] = 9999.0
    runs, findings = cut_at_resets(Kettle(), [joined([(lost, power)])])
    assert len(runs) == 1 and not findings
    assert (runs[0].states[:, 0] == lost).all()


def test_what_a_step_of_an_input_brings_every_time_is_no_beginning():
    # A thermometer beside the heater: part of the power is read at once.
    water, power = heated(3, 20.0)
    runs, findings = cut_at_resets(Kettle(), [joined([(water + 0.05 * power, power)])])
    assert len(runs) == 1 and not findings


def test_a_bearing_that_is_cut_at_half_a_turn_does_not_begin_anew():
    class Compass(FirstOrderSystem):
        dt = 0.1
        state_channels = (Channel("bearing", "deg", "other", scale=90.0),)
        action_channels = (Channel("rate", "deg/s", "input", scale=20.0),)

        def derivative(self, x, u, p):
            return u

    rate = 10.0 + np.sin(0.3 * np.arange(400))
    bearing = np.cumsum(rate) * 0.1
    wrapped = (bearing + 180.0) % 360.0 - 180.0
    run = Trajectory("log.csv", np.arange(400) * 0.1, wrapped[:, None], rate[:-1, None])
    runs, findings = cut_at_resets(Compass(), [run])
    assert len(runs) == 1 and not findings
    with pytest.raises(ValueError, match="jumps by a whole turn"):
        find_gap(Compass(), [run])
