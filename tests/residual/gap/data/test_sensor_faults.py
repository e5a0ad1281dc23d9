"""Sensors that fail are told and taken out; rest, noise and sudden pushes are no faults."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from swing import changed, kinds, noisy, sticking

from residual.gap.data.examine import examine, findings
from residual.logs.faults import dropped_samples, wild_samples
from residual.logs.frozen import frozen_samples
from residual.trajectories import Trajectory
from sims.pendulum_equation import PendulumEquation


@given(row=st.integers(3, 395), size=st.sampled_from([-1.0, 1.0]), column=st.integers(0, 1))
@settings(max_examples=40)
def test_a_wild_sample_is_taken_out_and_told(row, size, column):
    run = noisy()
    size *= (4.0, 12.0)[column]
    bad = changed(run, column, row, run.states[row, column] + size)
    done = examine(PendulumEquation(), [bad])
    (found,) = [one for one in done.findings if one.kind == "wild"]
    assert found.rows == (("run", float(run.times[row])),)
    assert np.isnan(done.trajectories[0].states[row, column])
    kept = np.isfinite(done.trajectories[0].states)
    assert kept.sum() == kept.size - 1
    np.testing.assert_array_equal(done.trajectories[0].states[kept], bad.states[kept])


@given(row=st.integers(5, 390), size=st.sampled_from([-1.0, 1.0]))
@settings(max_examples=20)
def test_a_spike_on_a_smooth_path_is_wild_even_if_motion_is_faster_elsewhere(row, size):
    """1 rad is less than eight times what the rate of a spin moves an angle in a sample."""
    run = noisy()
    spin = np.linspace(0, 40, 200)
    calm = np.array(run.states[:, 0])
    calm[row] += size
    wild = wild_samples([calm, spin])
    assert np.flatnonzero(wild[0]).tolist() == [row]
    assert not wild[1].any()


@given(speed=st.floats(0.02, 2.0), row=st.integers(20, 380))
@settings(max_examples=20)
def test_a_bounce_between_two_samples_is_no_wild_sample(speed, row):
    """It comes back, but as fast as it went."""
    path = speed * np.abs(np.arange(400.0) - row) + 1e-3 * np.random.default_rng(0).normal(size=400)
    assert not any(mask.any() for mask in wild_samples([path]))


@given(row=st.integers(3, 380), count=st.integers(1, 9))
@settings(max_examples=40)
def test_zeros_amid_motion_are_drop_outs(row, count):
    rows = slice(row, row + count)
    bad = changed(noisy(), 0, rows, 0.0)
    done = examine(PendulumEquation(), [bad])
    said = {one.kind for one in done.findings}
    assert said & {"dropped", "wild"}
    assert np.isnan(done.trajectories[0].states[rows, 0]).all()


@given(seed=st.integers(0, 50))
@settings(max_examples=20)
def test_many_zeros_are_drop_outs_too(seed):
    """As of a camera that loses a ball on a fifth of its pictures."""
    rng = np.random.default_rng(seed)
    run = noisy()
    away = dataclasses.replace(run, states=run.states + np.array([0.0, 8.0]))
    rows = np.sort(rng.choice(np.arange(2, 390), 80, replace=False))
    done = examine(PendulumEquation(), [changed(away, 1, rows, 0.0)])
    lost = np.isnan(done.trajectories[0].states[:, 1])
    assert lost[rows].mean() > 0.9
    assert not lost[np.setdiff1d(np.arange(len(lost)), rows)].any()


@pytest.mark.parametrize("value", [-20.0, 25.235])
def test_one_value_far_from_all_others_stands_for_what_was_not_read(value):
    rows = [50, 51, 52, 120, 121, 300]
    done = examine(PendulumEquation(), [changed(noisy(), 1, rows, value)])
    (found,) = [one for one in done.findings if one.kind in ("dropped", "wild")]
    assert found.kind == "dropped" and "6 " in found.says
    lost = np.isnan(done.trajectories[0].states[:, 1])
    assert np.flatnonzero(lost).tolist() == rows


@pytest.mark.parametrize("step", [0.01, 0.1, 0.3])
def test_a_rounded_peak_that_is_reached_again_is_a_peak(step):
    run = noisy()
    rounded = step * np.round(np.array(run.states) / step)
    assert "dropped" not in {kind for kind, _ in kinds(dataclasses.replace(run, states=rounded))}


def test_a_valve_that_opens_now_and_then_is_no_stand_in():
    pulses = np.zeros(400)
    pulses[[*range(50, 60), *range(100, 115), *range(300, 320)]] = 1.0
    assert not any(mask.any() for mask in dropped_samples([pulses]))


def turning():
    """Whole turns at a changing speed."""
    run = noisy()
    angle = run.states[:, 0] + 3 * run.times
    return dataclasses.replace(run, states=np.stack([angle, run.states[:, 1] + 3], axis=1))


@given(row=st.integers(10, 300), count=st.integers(40, 60))
@settings(max_examples=40)
def test_a_frozen_encoder_is_told_when_it_thaws(row, count):
    run = turning()
    rows = slice(row, row + count)
    bad = changed(run, 0, rows, run.states[row - 1, 0])
    done = examine(PendulumEquation(), [bad])
    assert "frozen" in {one.kind for one in done.findings}
    assert np.isnan(done.trajectories[0].states[rows, 0]).all()


@pytest.mark.parametrize(("row", "count"), [(160, 73), (160, 74), (285, 80)])
def test_a_longer_freeze_is_told_too(row, count):
    run = turning()
    bad = changed(run, 0, slice(row, row + count), run.states[row - 1, 0])
    assert "frozen" in {one.kind for one in findings(PendulumEquation(), [bad])}


def test_a_sensor_that_freezes_for_good_is_told_by_the_rate():
    run = noisy()
    bad = changed(run, 0, slice(325, None), run.states[324, 0])
    assert ("frozen", "angle") in kinds(bad)


def test_a_sensor_at_the_end_of_its_range_is_told():
    run = noisy()
    clipped = np.minimum(run.states[:, 1], 1.5)
    told = findings(PendulumEquation(), [changed(run, 1, slice(None), clipped)])
    (found,) = [one for one in told if one.kind == "clipped"]
    assert found.where == "rate"
    at_end = set(run.times[clipped == 1.5])
    assert {time for _, time in found.rows} <= at_end
    assert len(found.rows) > 0.9 * len(at_end)


def test_noise_at_the_end_of_its_range_does_not_hide_it():
    run = noisy()
    clipped = np.minimum(run.states[:, 1], 1.5)
    wobble = np.where(clipped == 1.5, 1e-3 * np.sin(np.arange(len(clipped))), 0.0)
    told = findings(PendulumEquation(), [changed(run, 1, slice(None), clipped + wobble)])
    (found,) = [one for one in told if one.kind == "clipped"]
    assert "stay at 1.5 rad/s" in found.words


@given(step=st.floats(0.001, 0.3), phase=st.floats(0, 6))
@settings(max_examples=40)
def test_a_rounded_swing_is_not_taken_for_a_clipped_one(step, phase):
    times = 0.01 * np.arange(1000)
    angle = np.pi + step * np.round(np.sin(2 * times + phase) / step)
    states = np.stack([angle, np.full(1000, np.nan)], axis=1)
    run = Trajectory("run", times, states, np.sin(times)[:-1, None])
    assert ("clipped", "angle") not in kinds(run)


def test_rest_is_no_frozen_sensor():
    times = 0.01 * np.arange(600)
    slowing = np.where(times < 2, 2 * times - 0.5 * times**2, 2.0)
    angle = 0.002 * np.round((np.pi + slowing) / 0.002)
    states = np.stack([angle, np.full(600, np.nan)], axis=1)
    run = Trajectory("run", times, states, np.sin(times)[:-1, None])
    assert not {kind for kind, _ in kinds(run)} & {"frozen", "dropped", "wild"}


@given(st.floats(70, 130), st.floats(60, 150), st.integers(0, 1000))
@settings(max_examples=10)
def test_a_servo_that_sticks_has_no_broken_encoder(breakaway, gain, seed):
    angle, volts = sticking(breakaway, gain, seed)
    states = np.stack([angle, np.full(len(angle), np.nan)], axis=1)
    run = Trajectory("run", 0.02 * np.arange(len(angle)), states, volts[:-1, None] / 300)
    assert not {kind for kind, _ in kinds(run)} & {"frozen", "clipped", "dropped", "wild"}


def pressure(seed, noise=2.0, step=0.01):
    """A tank that fills, and is full, with a pump that makes its pressure scatter."""
    rng = np.random.default_rng(seed)
    level = 100 * (1 - np.exp(-np.arange(200) / 40))
    return np.round((level + noise * rng.standard_normal(200)) / step) * step


@pytest.mark.parametrize("row", [20, 60, 150, 180])
@pytest.mark.parametrize("seed", range(3))
def test_where_readings_scatter_equal_ones_are_frozen(row, seed):
    """Also where the channel turns, or rests, so that nothing has to be caught up."""
    values = pressure(seed)
    assert not frozen_samples([values])[0].any()
    values[row : row + 15] = values[row]
    (frozen,) = frozen_samples([values])
    assert set(np.flatnonzero(frozen)) == set(range(row + 1, row + 15))


@given(
    noise=st.floats(0.1, 4.0), seed=st.integers(0, 100), row=st.integers(100, 270),
    level=st.floats(0.0, 1.0),
)  # fmt: skip
@settings(max_examples=200)
def test_rounded_readings_that_scatter_are_frozen_only_if_chance_cannot_make_them_equal(
    noise, seed, row, level
):
    """A thermometer's steps of a quarter; equal ones come in fives and sixes by chance."""
    drawn = level + noise * np.random.default_rng(seed).standard_normal(300)
    values = 0.25 * np.round(drawn + 20 * (1 - np.exp(-np.arange(300) / 40)))
    assert not frozen_samples([values])[0].any()
    values[row:] = values[row]
    (frozen,) = frozen_samples([values])
    first = row - np.argmin(values[row::-1] == values[row]) + 1
    ends = values[row] in (values.min(), values.max())
    assert ends or noise < 1 or np.flatnonzero(frozen).tolist() == list(range(first + 1, 300))


def test_where_readings_are_rounded_more_than_they_scatter_equal_ones_are_rest():
    for noise, step in ((0.1, 1.0), (0.0, 0.01)):
        assert not frozen_samples([pressure(0, noise, step)])[0].any()


def test_a_sensor_with_a_dead_band_about_zero_rests():
    speed = 5 + np.random.default_rng(0).standard_normal(200)
    speed[80:120] = 0.0
    assert not frozen_samples([speed])[0].any()


def test_absurd_readings_are_wild_however_many():
    """As where a decimal point was lost, in one sample of 25."""
    values = pressure(0)
    rows = np.arange(10, 190, 25)
    values[rows] *= 1e5
    (wild,) = wild_samples([values])
    assert set(np.flatnonzero(wild)) == set(rows)


def test_heavy_tails_are_noise():
    values = pressure(0)
    values[np.arange(10, 190, 25)] += 60.0
    assert not wild_samples([values])[0].any()


@pytest.mark.parametrize("seed", range(3))
def test_a_frozen_reading_of_what_rises_amid_noise_is_told_when_it_catches_up(seed):
    for noise in (0.0, 0.3):
        values = pressure(seed, noise, 0.001)
        values[30:45] = values[30]
        assert frozen_samples([values])[0][31:45].all()
    values[45:] -= values[45] - values[44] - 1.0  # what stuck goes on from where it was
    values[30:45] = values[30]
    assert not frozen_samples([np.round(values)])[0].any()


def test_stairs_are_not_frozen():
    assert not frozen_samples([np.repeat(np.arange(20.0), 12)])[0].any()


def test_two_accidents_in_a_short_log_are_no_heavy_tails():
    values = pressure(0)[:150]
    values[[40, 111]] += 200.0
    (wild,) = wild_samples([values])
    assert np.flatnonzero(wild).tolist() == [40, 111]
    values[[20, 60, 90, 130]] += 200.0
    assert not wild_samples([values])[0].any()


def test_a_single_wild_reading_makes_no_frozen_sensor_of_a_rest():
    """A servo that has come to its end and stays there; one of its readings is lost."""
    going = np.linspace(1.2, 0.0, 60)
    angle = np.concatenate([going, np.full(80, going[-1])])
    angle[100] = angle[99] - 1.6
    assert not frozen_samples([angle])[0].any()
    angle[100:] = angle[100]  # what it would have gone meanwhile: it did stick
    assert frozen_samples([angle])[0][61:100].all()


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("missing", [0.0, 0.03])
def test_a_frozen_reading_amid_motion_larger_than_its_noise_is_told_with_holes_in_it(seed, missing):
    rng = np.random.default_rng(seed)
    goals = np.repeat(rng.uniform(-15, 15, 12), 100)
    speed = np.zeros(len(goals))
    for k, goal in enumerate(goals[:-1]):
        speed[k + 1] = speed[k] + 0.02 * (goal - speed[k])
    seen = speed + 0.05 * rng.standard_normal(len(speed))
    (whole,) = frozen_samples([seen])
    assert not whole.any()
    seen[601:701] = seen[600]
    gone = rng.random(len(seen)) < missing
    gone[[600, 700]] = False
    seen[gone] = np.nan
    (frozen,) = frozen_samples([seen])
    assert set(np.flatnonzero(frozen)) == set(range(601, 701)) - set(np.flatnonzero(gone))


def test_a_rounded_axis_that_stops_and_goes_on_is_not_frozen_for_its_holes():
    rng = np.random.default_rng(0)
    pace = np.repeat(rng.choice([0.0, 0.4, -0.7, 1.1], 24), 50)
    seen = np.round(np.cumsum(np.convolve(pace, np.ones(8) / 8, "same")))
    seen[rng.random(len(seen)) < 0.03] = np.nan
    (frozen,) = frozen_samples([seen])
    assert not frozen.any()
