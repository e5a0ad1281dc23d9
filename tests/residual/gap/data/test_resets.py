"""Episodes in one record, times going on: cut where a position leaps, and nowhere else."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from residual.gap import find_gap
from residual.gap.data.resets import cut_at_resets, leapt
from residual.trajectories import Trajectory
from sims.pendulum_equation import PendulumEquation
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
    assert finding.says.startswith("log.csv begins anew 7 times without saying so, first at ")


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
