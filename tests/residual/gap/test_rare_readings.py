"""Rows without a reading, as where sensors of unlike rates share a table."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from residual.gap import find_gap
from residual.gap.data.samples import Samples
from residual.gap.preparation.prepare import prepare
from residual.trajectories import Trajectory
from sims.effects import ConstantLoad, CoulombFriction
from sims.pendulum_equation import PendulumEquation

NOISE = np.array([0.003, 0.03])
#: Enough to be wrong with.
OFFERED = ("coulomb_friction", "viscous_friction", "mass")


def log(effects=(), every=(1, 1), seconds=20.0, seed=0):
    """A hanging pendulum at 100 Hz, its angle and rate read every so many rows."""
    rng = np.random.default_rng(seed)
    simulator = PendulumEquation(dt=0.01).with_effects(list(effects))
    steps = round(seconds / simulator.dt)
    volts = np.repeat(rng.uniform(-1.0, 1.0, (1, steps // 25, 1)), 25, axis=1)
    states = simulator.rollout(np.array([[np.pi + 0.1, 0.0]]), volts)[0]
    states += NOISE * rng.standard_normal(states.shape)
    for column, rows in enumerate(every):
        states[np.arange(len(states)) % rows != 0, column] = np.nan
    return Trajectory("run", simulator.dt * np.arange(len(states)), states, volts[0])


@given(stride=st.sampled_from([2, 4, 8]), every=st.integers(1, 9), seed=st.integers(0, 1000))
@settings(max_examples=40)
def test_inputs_between_rows_keep_their_integral_wherever_the_readings_are(stride, every, seed):
    rng = np.random.default_rng(seed)
    times = np.arange(65.0)
    states = rng.standard_normal((65, 1))
    states[np.arange(65) % every != 0] = np.nan
    run = Trajectory("run", times, states, rng.standard_normal((64, 1)))
    samples = Samples.join([run], 1, stride)
    rows = samples.recorded[0].rows
    held = run.actions[:, 0]
    driven = np.append(held, held[-1])[None, :, None, None, None] * np.array([1.0, 0.0])
    found = samples.in_intervals(driven)[0, :-1, 0, 0, 0]
    parts = [(held * run.durations)[a:b].sum() for a, b in itertools.pairwise(rows)]
    np.testing.assert_allclose(found * samples.durations[:-1], parts)


def test_rows_of_a_thinned_log_are_those_with_readings():
    run = log(every=(10, 5), seconds=4.0)
    samples = Samples.join([run], 1, 4)
    assert np.isfinite(samples.seen).sum() == np.isfinite(run.states).sum()
    whole = Samples.join([log(seconds=4.0)], 1, 4)
    np.testing.assert_array_equal(whole.times, whole.times[0] + 0.04 * np.arange(len(whole)))


@pytest.mark.parametrize("every", [
    pytest.param((1, 1), marks=pytest.mark.long), (5, 5), (7, 3),
    pytest.param((20, 1), marks=pytest.mark.long), pytest.param((1, 20), marks=pytest.mark.long),
])  # fmt: skip
def test_noise_is_told_from_motion(every):
    run = log([ConstantLoad("pivot", 0.005)], every)
    ready = prepare(PendulumEquation(dt=0.01), [run], 1.0)
    ratio = ready.floor.sigma / NOISE
    assert (ratio < 2.5).all() and (ratio > 0.4).all()  # 0.004 and less before, of five and seven


@pytest.mark.parametrize(("effects", "kind"), [
    pytest.param((CoulombFriction("pivot", 0.003),), "confirmed", marks=pytest.mark.long),
    ((), "no_gap"),
])  # fmt: skip
def test_an_answer_does_not_take_every_row_for_a_reading(effects, kind):
    result = find_gap(PendulumEquation(dt=0.01), [log(effects, (5, 5), 12.0)], effects=OFFERED)
    assert result.verdicts[0].kind == kind
    if effects:
        named = result.effects[0]
        assert isinstance(named, CoulombFriction)
        assert named.level == pytest.approx(0.003, rel=0.1)
        assert len(result.effects) == len(effects)


@pytest.mark.long
def test_what_noise_alone_makes_is_not_put_down_to_parameters():
    """A hundred readings of the angle alone: 46 % of the "gap" were parameters off by 0.1 %."""
    run = log(every=(20, 1))
    alone = dataclasses.replace(run, states=np.where([True, False], run.states, np.nan))
    result = find_gap(PendulumEquation(dt=0.01), [alone], effects=OFFERED)
    assert [verdict.kind for verdict in result.verdicts][:1] == ["no_gap"]
    assert not result.effects
