"""Thinning and sub-steps lose nothing, and how inputs run is told by the data."""

import dataclasses
from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from slides import Slide, braked, recorded

from residual.gap import find_gap
from residual.gap.confirmation.numerics import with_enough_substeps
from residual.gap.data.samples import Samples
from residual.gap.preparation.numerics import (
    ROWS,
    enough_substeps,
    held_as,
    own_substeps,
    stride_for,
)
from residual.trajectories import Trajectory
from sims.effects import Delay, ParameterChange
from sims.effects.library import library
from sims.equations import FirstOrderSystem
from sims.pendulum_equation import PendulumEquation
from sims.simulator import Channel, Parameter
from studies.hidden.data import Truth, make_logs


def record(rows, step=0.01, seed=0):
    rng = np.random.default_rng(seed)
    states, volts = rng.standard_normal((rows + 1, 2)), rng.standard_normal((rows, 1))
    return Trajectory("run", step * np.arange(rows + 1.0), states, volts)


@given(st.sampled_from([2, 4, 8]), st.sampled_from([1, 2, 8, 16]), st.integers(0, 1000))
@settings(max_examples=40)
def test_merged_inputs_keep_their_integral_and_first_moment(stride, substeps, seed):
    run = record(64)
    samples = Samples.join([run], substeps, stride)
    fine = samples.recorded_substeps
    driven = np.random.default_rng(seed).standard_normal((3, len(run) + 1, fine, 1, 2))
    found = samples.in_intervals(driven)
    assert found.shape == (3, len(samples), substeps, 1, 2)

    # Each piece is a straight line from mean - rise/2 to mean + rise/2; a moment is about the
    # middle of the merged sub-step.
    def integrals(mean, rise, pieces):
        middle = (np.arange(pieces) + 0.5) / pieces - 0.5
        length = 1 / pieces
        first = (mean * middle + rise * length / 12).sum(axis=2) * length
        return mean.sum(axis=2) * length, first

    whole = driven[:, : (len(samples) - 1) * stride, :, 0]
    count = stride * fine // substeps
    pieces = whole.reshape(3, -1, count, 2)
    before = integrals(pieces[..., 0], pieces[..., 1], count)
    merged = found[:, :-1, :, 0].reshape(3, -1, 1, 2)
    after = integrals(merged[..., 0], merged[..., 1], 1)
    for one, other in zip(before, after, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12)


@given(st.floats(1e-3, 0.1), st.floats(0.01, 20))
@settings(max_examples=60)
def test_a_horizon_keeps_rows_enough_after_thinning(step, horizon):
    stride = stride_for([record(10, step)], horizon)
    assert np.log2(stride) == int(np.log2(stride))
    assert stride == 1 or horizon / (stride * step) >= ROWS * (1 - 1e-6)
    assert horizon / (stride * step) < 2 * ROWS * (1 + 1e-6) or stride >= 1


def test_an_interval_of_a_thinned_log_has_whole_sub_steps():
    simulator = PendulumEquation()
    for step in (0.001, 0.002, 0.01):
        runs = [record(100, step)]
        stride = stride_for(runs, 2.0)
        steps = own_substeps(simulator, runs, stride)
        assert stride % steps == 0 or steps % stride == 0
        assert simulator.dt / simulator.substeps >= stride * step / steps  # as fine as its own


def slid(seed, friction=1300.0, rows=600):
    """Positions of the slide under steps of PWM, by closed form: it follows within 3 ms."""
    rng = np.random.default_rng(seed)
    pwm = np.repeat(rng.uniform(-300, 300, rows // 10 + 1), 10)[:rows]
    places = braked(0.5 * friction / 300.0 * pwm, friction, 4.0, 0.02)
    return recorded(f"run {seed}", places, pwm, 0.02, 2e-5, rng)


@pytest.mark.long
def test_friction_too_fast_for_steps_that_suit_the_nominal_simulator_is_found_and_judged():
    offered = [e for e in library(Slide()) if e.name in ("viscous_friction", "actuator_gain")]
    found = find_gap(Slide(), [slid(0)], held_out=[slid(1)], effects=offered, hold="zero")
    by_name = {verdict.effect: verdict for verdict in found.verdicts}
    friction = by_name["viscous_friction"].parameters["coefficient"]
    assert friction.low < 1240.0 < friction.high  # beside a damping of 60
    assert friction.value == pytest.approx(1240.0, rel=0.3)  # inertia hardly shows
    assert found.held_out.before.value > 0.1
    assert found.held_out.after.value < 1e-3


def test_sub_steps_are_as_few_as_cannot_be_seen():
    simulator = PendulumEquation()
    logs = make_logs(Truth(), 3, "strong", "A", 3)
    most = own_substeps(simulator, logs, 1)
    samples = Samples.join(logs, most)
    counts = [
        enough_substeps(simulator, samples, samples.seen, scale * np.array([0.01, 0.2]), most)
        for scale in (1e-9, 1e-2, 1.0, 1e3)
    ]
    assert counts[0] == most
    assert counts[-1] == 1
    assert counts == sorted(counts, reverse=True)


def swung(simulator, hold, seed=0, runs=3, rows=400, step=0.02):
    """Logs of a simulator whose voltage is held between samples, or runs straight."""
    rng = np.random.default_rng(seed)
    made = []
    for number in range(runs):
        volts = np.convolve(rng.standard_normal(rows + 8), np.ones(8) / 3, "valid")[:rows, None]
        volts = np.clip(volts, -3, 3)
        true = type(simulator)(dt=step).with_parameters(
            **{name: p.value for name, p in simulator.parameters.items()}
        )
        path = true.with_hold({"voltage": hold}).rollout(np.array([np.pi, 0.0]), volts)
        seen = path[:, :2] + rng.standard_normal((rows + 1, 2)) * [0.002, 0.02]
        made.append(Trajectory(f"run {number}", step * np.arange(rows + 1.0), seen, volts))
    return made


FEW = (ParameterChange("mass"), Delay("voltage"))


@pytest.mark.parametrize("hold", ["zero", pytest.param("linear", marks=pytest.mark.long)])
def test_how_inputs_run_between_samples_is_told_by_the_data(hold):
    logs = swung(PendulumEquation(mass=0.09), hold)
    found = find_gap(PendulumEquation(), logs, effects=FEW, horizon=0.4, minutes=20.0)
    assert found.corrected.action_channels[0].hold == hold
    assert any("straight" in one.says for one in found.quality) == (hold == "linear")
    # With the wrong hold half a sample would be taken for a delay.
    assert [e.name for e in found.effects] == ["mass"]


def test_a_hold_that_is_given_is_kept():
    for hold in ("linear", {"voltage": "linear"}):
        assert held_as(PendulumEquation(), hold).action_channels[0].hold == "linear"
    assert held_as(PendulumEquation(), None).action_channels[0].hold == "zero"


@pytest.mark.long
def test_a_large_gap_does_not_turn_the_hold():
    logs = make_logs(Truth(mass=0.636), 11, "strong", "A", 4)
    found = find_gap(PendulumEquation(), logs, effects=FEW, minutes=20.0)
    assert [e.name for e in found.effects] == ["mass"]
    assert found.corrected.action_channels[0].hold == "zero"


def test_a_log_without_a_step_is_refused():
    run = record(3)
    short = dataclasses.replace(
        run, times=run.times[:1], states=run.states[:1], actions=run.actions[:0]
    )
    with pytest.raises(ValueError, match="at least one with a step"):
        Samples.join([short], 1)


class Wheel(FirstOrderSystem):
    """A wheel that is logged once a second."""

    dt = 1.0
    state_channels = (Channel("speed", "rad/s", "rate", scale=10.0),)
    action_channels = (Channel("duty", "1", "input", low=-1.0, high=1.0),)
    parameters: ClassVar = {
        "gain": Parameter(20.0, "rad/s", "speed at full duty"),
        "late": Parameter(0.4, "s", "time constant", low=0.02),
    }

    def derivative(self, x, u, p):
        return ((p.gain * u[:, 0] - x[:, 0]) / p.late)[:, None]


@pytest.mark.parametrize(("late", "stable"), [(0.4, True), (0.06, False)])
def test_a_corrected_simulator_that_is_faster_takes_finer_steps(late, stable):
    """Five steps of 0.2 s are unstable for a time constant of 0.06 s."""
    duty = np.random.default_rng(0).uniform(-1, 1, (200, 1))
    x = np.zeros((201, 1))
    for k in range(200):  # the exact solution
        x[k + 1] = 20 * duty[k] + (x[k] - 20 * duty[k]) * np.exp(-1.0 / late)
    samples = Samples.join([Trajectory("run", np.arange(201.0), x, duty)], 5)
    search = SimpleNamespace(
        fitter=SimpleNamespace(samples=samples, sigma=np.array([1.0])),
        tried={(0,): SimpleNamespace(inner=SimpleNamespace(nodes=x))},
    )
    coarse = Wheel().with_effects([ParameterChange("late", late - 0.4)])
    fine = with_enough_substeps(coarse, search, (0,))
    assert (fine.substeps == coarse.substeps) is stable
    with np.errstate(all="ignore"):
        strayed = np.abs(coarse.rollout(x[0], duty) - x).max()
    assert bool(strayed < 0.1) is stable
    assert np.abs(fine.rollout(x[0], duty) - x).max() < 0.1
