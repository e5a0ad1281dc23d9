"""What is said about the data before any physics, and which logs are refused."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from swing import changed, kinds, noisy

from residual.gap import find_gap
from residual.gap.data.examine import examine, findings
from residual.gap.data.kinematics import kinematics
from residual.gap.data.other_clock import any_other_clock
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
    assert (runs, found) == (logs, [])


def test_noise_in_the_rate_is_not_taken_for_a_smaller_scale():
    # A wide dead zone leaves little motion, so most of the measured rate is noise.
    logs = make_logs(Truth(dead_zone=0.58), 4, "weak", "A", 15)
    assert kinematics(PendulumEquation(), logs) == (logs, [])


def two_sensors(late_angle, late_rate, noise, seed):
    """Readings every 10 ms of an angle and its rate, each late by a time and with noise of a share
    of what it spans; several sines of up to 2 Hz."""
    rng = np.random.default_rng(seed)
    pace, size, phase = rng.uniform(1, 12, 5), rng.uniform(0.1, 0.5, 5), rng.uniform(0, 6, 5)
    times = 0.01 * np.arange(1500)
    at = np.multiply.outer(times - late_angle, pace) + phase
    angle = np.pi + np.sin(at) @ size
    at = np.multiply.outer(times - late_rate, pace) + phase
    states = np.stack([angle, np.cos(at) @ (size * pace)], axis=1)
    states += noise * np.ptp(states, axis=0) * rng.standard_normal(states.shape)
    return [Trajectory("run", times, states, np.zeros((1499, 1)))]


@pytest.mark.parametrize("noise", [0.0, 1e-3, 5e-3])
@pytest.mark.parametrize(
    ("angle", "rate", "who"), [(0.03, 0.0, "angle"), (0.0, 0.02, "rate"), (0.05, 0.03, "angle")]
)
def test_a_sensor_that_is_late_beside_the_other_is_put_on_its_time(angle, rate, who, noise):
    logs = two_sensors(angle, rate, noise, 7)
    runs, found = kinematics(PendulumEquation(), logs)
    prompt = two_sensors(min(angle, rate), min(angle, rate), 0.0, 7)[0].states
    off = np.std(runs[0].states[:-6] - prompt[:-6], axis=0) / np.ptp(prompt, axis=0)
    assert (off < noise + 0.01).all()
    (finding,) = found
    assert (finding.kind, finding.where) == ("late", who)
    assert finding.numbers["seconds"] == pytest.approx(abs(angle - rate), rel=0.15)
    assert "late or filtered" in finding.says


@given(
    late=st.floats(0, 0.2), noise=st.sampled_from([1e-4, 3e-3, 1e-2, 3e-2]), seed=st.integers(0, 99)
)
@settings(max_examples=25)
def test_sensors_that_are_equally_late_are_not_told_apart(late, noise, seed):
    assert kinematics(PendulumEquation(), two_sensors(late, late, noise, seed))[1] == []


def test_seconds_that_are_taken_for_hours_are_refused():
    (run,) = swings(1.0)
    period = 3600 * PendulumEquation().dt
    slow = dataclasses.replace(run, times=period * np.arange(len(run.times)))
    with pytest.raises(ValueError, match=r"run: a sample every .*unit: s}"):
        examine(PendulumEquation(), [slow])


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


def test_a_parameter_of_zero_that_makes_no_number_is_named():
    says = r"\(its inertia is 0\) returns .* from the state recorded at"
    with pytest.raises(ValueError, match=says):
        examine(PendulumEquation().with_parameters(inertia=0.0), [noisy()])


def test_no_log_is_refused():
    with pytest.raises(ValueError, match="there are no trajectories"):
        find_gap(PendulumEquation(), [])


def test_a_clean_log_has_no_findings():
    for seed in range(5):
        assert kinds(noisy(seed)) == set()


@pytest.mark.parametrize("truth", [
    Truth(), pytest.param(Truth(coulomb_friction=1e-3), marks=pytest.mark.long),
    Truth(dead_zone=1.0),
])  # fmt: skip
@pytest.mark.parametrize("excitation", ["strong", "weak", "policy"])
def test_logs_of_known_truth_have_no_findings(truth, excitation):
    for noise in ("A", "C"):
        assert findings(PendulumEquation(), make_logs(truth, 1, excitation, noise, 2, 60)) == []


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


def test_a_command_within_its_bounds_the_other_way_round_is_refused_with_the_sign():
    class OneWay(PendulumEquation):
        action_channels = (dataclasses.replace(PendulumEquation.action_channels[0], low=0.0),)

    run = noisy()
    pulled = dataclasses.replace(run, actions=-np.abs(run.actions))
    with pytest.raises(ValueError, match=r"voltage: reaches .*the other sign \(`scale: -1`\)"):
        examine(OneWay(), [pulled])


def test_a_channel_that_never_changes_is_taken_as_not_measured():
    bad = changed(noisy(), 1, slice(None), 0.0)
    done = examine(PendulumEquation(), [bad])
    assert [(one.kind, one.where) for one in done.findings] == [("still", "rate")]
    assert np.isnan(done.trajectories[0].states[:, 1]).all()


def test_a_log_in_which_nothing_moves_is_refused():
    bad = changed(changed(noisy(), 1, slice(None), 0.0), 0, slice(None), 3.0)
    with pytest.raises(ValueError, match="ever changes"):
        examine(PendulumEquation(), [bad])


def test_minutes_that_are_taken_for_seconds_are_told():
    period = PendulumEquation().dt
    for part, unit in (
        (1 / 60, "unit: min"), (1 / 57, "unit: min"), (1 / 3600, "unit: h"), (1 / 40, None),
        (1, None), (57, "unit: s"), (1 / 1000, "unit: s"), (1 / 500, None),
    ):  # fmt: skip
        run = dataclasses.replace(noisy(), times=part * period * np.arange(400))
        found = [f for f in findings(PendulumEquation(), [run]) if f.kind == "sampling"]
        assert [unit in one.says for one in found] == [True] * (unit is not None)


def test_a_second_between_samples_is_told():
    slow = dataclasses.replace(noisy(), times=1.0 * np.arange(400))
    (found,) = [one for one in findings(PendulumEquation(), [slow]) if one.kind == "sampling"]
    assert found.severity == "warning"
    assert "20 control periods" in found.says
    assert "what the input did" in found.says
    free = dataclasses.replace(slow, actions=0 * slow.actions)
    (found,) = [one for one in findings(PendulumEquation(), [free]) if one.kind == "sampling"]
    assert "input" not in found.says


@given(step=st.floats(0.01, 0.2))
@settings(max_examples=20)
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


def test_a_record_that_is_given_twice_counts_once():
    logs = make_logs(Truth(), 3, "strong", "A", 5)
    again = dataclasses.replace(logs[1], name="copy.csv", times=logs[1].times + 100.0)
    examined = examine(PendulumEquation(), [*logs, again])
    assert [run.name for run in examined.trajectories] == [run.name for run in logs]
    (told,) = [one for one in examined.findings if one.kind == "copy"]
    assert told.where == "copy.csv"
    assert logs[1].name in told.says
    assert not [one for one in examine(PendulumEquation(), logs).findings if one.kind == "copy"]


def test_records_at_rest_are_alike_and_no_copies():
    rest = Trajectory("rest", 0.1 * np.arange(30), np.zeros((30, 2)), np.zeros((29, 1)))
    logs = [*swings(1.0), rest, dataclasses.replace(rest, name="rest again")]
    assert len(examine(PendulumEquation(), logs).trajectories) == 3


def spoilt(value, rows=(100,)):
    """Logs whose first voltage is wild in some samples."""
    logs = make_logs(Truth(), 2, "strong", "A", 5)
    volts = np.array(logs[0].actions)
    volts[list(rows), 0] = value
    return [dataclasses.replace(logs[0], actions=volts), logs[1]]


class Unbounded(PendulumEquation):
    """A pendulum of which nobody said what it can be told."""

    action_channels = (dataclasses.replace(PendulumEquation.action_channels[0], low=-np.inf,
                                           high=np.inf),)  # fmt: skip


@pytest.mark.parametrize("simulator", [PendulumEquation(), Unbounded()])
def test_a_record_is_cut_at_a_command_that_nobody_can_have_meant(simulator):
    logs = spoilt(3000.0)
    examined = examine(simulator, logs)
    (told,) = [one for one in examined.findings if one.kind == "wild"]
    assert told.where == "voltage"
    assert "3000 V in 1 of" in told.says
    rows = [len(run.times) for run in examined.trajectories]
    assert rows == [101, len(logs[0].times) - 101, len(logs[1].times)]
    assert max(np.abs(run.actions).max() for run in examined.trajectories) < 10


@pytest.mark.parametrize(("value", "rows"), [(3000.0, (100, 101)), (20.0, (100,))])
def test_a_command_that_may_have_been_meant_is_left(value, rows):
    """A kick of two samples, or one not so far beyond the others."""
    examined = examine(Unbounded(), spoilt(value, rows))
    assert len(examined.trajectories) == 2
    assert not [one for one in examined.findings if one.kind == "wild"]


@pytest.mark.parametrize("step", [0.05, 0.12, 0.2])
def test_a_coarse_encoder_is_no_reason_to_blame_the_rate(step):
    """In most stretches its angle does not change at all."""
    (run,) = swings(1.0)
    coarse = np.round(run.states / np.array([step, 1e-9])) * np.array([step, 1e-9])
    noisy = coarse + np.random.default_rng(0).standard_normal(coarse.shape) * np.array([0.0, 0.02])
    coarse = dataclasses.replace(run, states=noisy)
    assert kinematics(PendulumEquation(), [coarse])[1] == []


@pytest.mark.parametrize("bias", [0.3, -0.8])
def test_a_rate_whose_zero_is_off_is_not_on_another_scale(bias):
    """A gyro's bias is an effect of the library; a scale that makes up for it would hide it."""
    (run,) = swings(1.0)
    wandering = run.states + np.stack([0.5 * run.times, np.full(501, 0.5 + bias)], axis=1)
    logs = [dataclasses.replace(run, states=wandering)]
    assert kinematics(PendulumEquation(), logs) == (logs, [])


@pytest.mark.parametrize(
    ("seconds", "said", "unsaid"),
    [
        (3150.0, ("are in ms", "counts in h, to {column: time, scale: 0.000277778}"), ("in min",)),
        (15.0, ("are in s,", "counts in min, to"), ("in ms", "counts in h,")),
        (250.0, ("are in ms, set",), ("counts in h",)),
    ],
    ids=["h", "min", "ms"],
)
def test_a_log_of_too_few_samples_may_be_of_a_simulator_on_another_clock(seconds, said, unsaid):
    told = any_other_clock(seconds / 0.25)
    assert all(words in told for words in said) and not any(words in told for words in unsaid)
