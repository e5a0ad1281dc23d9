"""What is said about the data before any physics, and which logs are refused."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from residual.gap import find_gap
from residual.gap.data import examine, findings
from residual.gap.kinematics import kinematics
from residual.logs.faults import dropped_samples
from residual.trajectories import Trajectory
from sims.leo import Leo
from sims.pendulum_equation import PendulumEquation
from studies.hidden.data import Truth, make_logs


def swings(factor):
    times = np.linspace(0, 5, 501)
    angle = np.pi + 0.3 * np.sin(4 * times)
    states = np.stack([angle, 1.2 * np.cos(4 * times) * factor], axis=1)
    return [Trajectory("run", times, states, np.zeros((500, 1)))]


def test_a_rate_on_another_scale_is_put_right_and_told():
    runs, found = kinematics(PendulumEquation(), swings(1 / 1.05))
    assert len(found) == 1
    assert "1.05" in found[0].says
    np.testing.assert_allclose(runs[0].states, swings(1.0)[0].states, rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("excitation", ["strong", "weak", "policy"])
def test_coarse_sampling_is_no_reason_to_blame_the_sensor(excitation):
    logs = make_logs(Truth(), 3, excitation, "A", 5)
    runs, found = kinematics(PendulumEquation(), logs)
    assert found == []
    assert runs == logs


def test_noise_in_the_rate_is_not_taken_for_a_smaller_scale():
    # A wide dead zone leaves little motion, so most of the measured rate is noise.
    logs = make_logs(Truth(dead_zone=0.58), 4, "weak", "A", 15)
    assert kinematics(PendulumEquation(), logs) == (logs, [])


def test_times_in_ms_are_refused():
    (run,) = swings(1.0)
    examine(PendulumEquation(), [run])
    slow = dataclasses.replace(run, times=1000 * run.times)
    with pytest.raises(ValueError, match=r"run: a sample every 10 s, .*unit: ms"):
        examine(PendulumEquation(), [slow])


def test_a_walk_without_one_encoder_is_refused():
    states = np.full((20, 18), np.nan)
    states[:, :9] = np.linspace(0, 0.1, 20)[:, None]
    walk = Trajectory("walk", 0.03 * np.arange(20), states, np.zeros((19, 6)))
    assert not any(one.kind == "unmeasured" for one in findings(Leo(), [walk]))
    states[:, 5] = np.nan
    with pytest.raises(ValueError, match=r"walk: .*'left_knee' was not logged"):
        examine(Leo(), [walk])


def test_no_log_is_refused():
    with pytest.raises(ValueError, match="there are no trajectories"):
        find_gap(PendulumEquation(), [])


def noisy(seed=0, n=400, dt=0.05):
    """A swing with noise in angle and rate, and an input that changes."""
    rng = np.random.default_rng(seed)
    times = dt * np.arange(n)
    angle = np.pi + np.sin(2 * times) + 0.003 * rng.standard_normal(n)
    rate = 2 * np.cos(2 * times) + 0.02 * rng.standard_normal(n)
    volts = np.repeat(rng.uniform(-2, 2, n // 10 + 1), 10)[: n - 1, None]
    return Trajectory("run", times, np.stack([angle, rate], axis=1), volts)


def kinds(run, simulator=None):
    return {(one.kind, one.where) for one in findings(simulator or PendulumEquation(), [run])}


def changed(run, column, rows, values):
    states = np.array(run.states)
    states[rows, column] = values
    return dataclasses.replace(run, states=states)


def test_a_clean_log_has_no_findings():
    for seed in range(5):
        assert kinds(noisy(seed)) == set()


@pytest.mark.parametrize("truth", [Truth(), Truth(coulomb_friction=1e-3), Truth(dead_zone=1.0)])
@pytest.mark.parametrize("excitation", ["strong", "weak", "policy"])
def test_logs_of_known_truth_have_no_findings(truth, excitation):
    for noise in ("A", "C"):
        assert findings(PendulumEquation(), make_logs(truth, 1, excitation, noise, 2, 100)) == []


@given(row=st.integers(3, 395), size=st.sampled_from([-1.0, 1.0]), column=st.integers(0, 1))
@settings(max_examples=40, deadline=None)
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


@given(row=st.integers(3, 380), count=st.integers(1, 9))
@settings(max_examples=40, deadline=None)
def test_zeros_amid_motion_are_drop_outs(row, count):
    rows = slice(row, row + count)
    bad = changed(noisy(), 0, rows, 0.0)
    done = examine(PendulumEquation(), [bad])
    said = {one.kind for one in done.findings}
    assert said & {"dropped", "wild"}
    assert np.isnan(done.trajectories[0].states[rows, 0]).all()


@given(seed=st.integers(0, 50))
@settings(max_examples=20, deadline=None)
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
    (found,) = [one for one in done.findings if one.kind == "dropped"]
    assert "6 " in found.says
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
@settings(max_examples=40, deadline=None)
def test_a_frozen_encoder_is_told_when_it_thaws(row, count):
    run = turning()
    rows = slice(row, row + count)
    bad = changed(run, 0, rows, run.states[row - 1, 0])
    done = examine(PendulumEquation(), [bad])
    assert "frozen" in {one.kind for one in done.findings}
    assert np.isnan(done.trajectories[0].states[rows, 0]).all()


@pytest.mark.xfail(strict=True, reason="a long freeze may go unseen, by where it begins and ends")
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


@given(step=st.floats(0.001, 0.3), phase=st.floats(0, 6))
@settings(max_examples=40, deadline=None)
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


def test_an_input_beyond_its_bounds_is_told_and_one_in_mV_refused():
    run = noisy()
    volts = np.array(run.actions)
    volts[100:104] = 3.6
    beyond = dataclasses.replace(run, actions=volts)
    (found,) = findings(PendulumEquation(), [beyond])
    assert (found.kind, found.severity, len(found.rows)) == ("bounds", "warning", 4)
    np.testing.assert_array_equal(
        examine(PendulumEquation(), [beyond]).trajectories[0].actions, volts
    )
    with pytest.raises(ValueError, match=r"voltage: reaches .* V, beyond .*mV"):
        examine(PendulumEquation(), [dataclasses.replace(run, actions=1000 * run.actions)])


def test_a_channel_that_never_changes_is_taken_as_not_measured():
    bad = changed(noisy(), 1, slice(None), 0.0)
    done = examine(PendulumEquation(), [bad])
    assert [(one.kind, one.where) for one in done.findings] == [("still", "rate")]
    assert np.isnan(done.trajectories[0].states[:, 1]).all()


def test_a_log_in_which_nothing_moves_is_refused():
    bad = changed(changed(noisy(), 1, slice(None), 0.0), 0, slice(None), 3.0)
    with pytest.raises(ValueError, match="ever changes"):
        examine(PendulumEquation(), [bad])


def test_a_second_between_samples_is_told():
    slow = dataclasses.replace(noisy(), times=1.0 * np.arange(400))
    (found,) = [one for one in findings(PendulumEquation(), [slow]) if one.kind == "sampling"]
    assert found.severity == "warning"
    assert "20 control periods" in found.says


@given(step=st.floats(0.01, 0.2))
@settings(max_examples=20, deadline=None)
def test_rounded_columns_are_told_with_their_step(step):
    run = noisy(dt=0.01)
    bad = changed(run, 0, slice(None), step * np.round(run.states[:, 0] / step))
    (found,) = [one for one in findings(PendulumEquation(), [bad]) if one.kind == "rounded"]
    assert found.numbers["step"] == pytest.approx(step, rel=1e-6)


@pytest.mark.parametrize("rule", ["before", "after", "mean"])
def test_a_sum_of_the_rate_is_no_measurement_of_the_angle(rule):
    run = noisy()
    rate, steps = run.states[:, 1], np.diff(run.times)
    used = {"before": rate[:-1], "after": rate[1:], "mean": 0.5 * (rate[1:] + rate[:-1])}[rule]
    summed = np.pi + np.concatenate([[0.0], np.cumsum(steps * used)])
    assert ("integral", "angle") in kinds(changed(run, 0, slice(None), summed))

    class Declared(PendulumEquation):
        state_channels = tuple(
            dataclasses.replace(c, integrates="rate") if c.name == "angle" else c
            for c in PendulumEquation.state_channels
        )

    declared = changed(run, 0, slice(None), summed)
    assert ("integral", "angle") not in kinds(declared, Declared())


def test_a_simulator_that_breaks_down_on_a_recorded_state_is_refused_with_its_time():
    class Broken(PendulumEquation):
        def acceleration(self, q, v, u, force, p):
            return super().acceleration(q, v, u, force, p) / np.where(q > 4.0, 0.0, 1.0)

    with pytest.raises(ValueError, match=r"run: .* returns (nan|-?inf) for .* at [\d.]+ s"):
        examine(Broken(), [noisy()])
