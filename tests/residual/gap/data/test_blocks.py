"""Folds interpolate, and neither order nor names of files matter."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from residual.gap.data.blocks import FOLDS, blocks, drive
from residual.gap.data.samples import Samples
from residual.gap.data.windows import cut, fixed
from residual.trajectories import Trajectory


def table(seed, runs=4, rows=120):
    """Runs from slow to fast, as experiments are often made."""
    rng = np.random.default_rng(seed)
    made = []
    for number in range(runs):
        size = (number + 1) * rng.uniform(0.5, 1.5)
        states = size * rng.standard_normal((rows + 1, 2))
        volts = size * rng.standard_normal((rows, 1))
        made.append(Trajectory(f"run {number}", 0.1 * np.arange(rows + 1.0), states, volts))
    return made


def dealt(runs, most=1000, length=5):
    samples = Samples.join(runs, 1)
    hard = drive(samples, samples.seen, np.array([1]))
    return samples, hard, blocks(samples, fixed(samples, length), hard, most)


def means(hard, found):
    """Mean drive of every block."""
    windows = found.windows
    by_window = [hard[i[k]].mean() for i, k in zip(windows.index, windows.inside, strict=True)]
    return np.array([np.mean(np.array(by_window)[found.block == b]) for b in range(len(found))])


@given(st.integers(0, 500))
@settings(max_examples=30)
def test_every_fold_has_its_share_of_slow_and_fast_blocks(seed):
    _, hard, found = dealt(table(seed))
    ranked = found.fold[np.argsort(means(hard, found), kind="stable")]
    whole = len(ranked) // FOLDS * FOLDS
    for lap in ranked[:whole].reshape(-1, FOLDS):
        assert sorted(lap) == list(range(FOLDS))
    # Dealt to and fro, no fold is harder than another.
    ranks = np.arange(len(ranked))
    middle = [ranks[ranked == fold].mean() for fold in range(FOLDS)]
    assert np.ptp(middle) <= FOLDS


@given(st.integers(0, 100), st.permutations(range(4)))
@settings(max_examples=20)
def test_the_order_and_the_names_of_files_do_not_matter(seed, order):
    runs = table(seed)
    other = [Trajectory(f"file {i}", runs[i].times, runs[i].states, runs[i].actions) for i in order]
    (one, _, mine), (two, _, its) = dealt(runs), dealt(other)
    np.testing.assert_array_equal(one.seen, two.seen)
    np.testing.assert_array_equal(mine.fold, its.fold)
    np.testing.assert_array_equal(mine.windows.index, its.windows.index)


def test_a_block_is_consecutive_and_holds_no_window_twice():
    samples, _, found = dealt(table(1))
    rows = found.windows.index[found.windows.inside]
    assert len(np.unique(rows)) == len(rows) > 0.95 * len(samples)
    for number in range(len(found)):
        own = found.windows.index[found.block == number].ravel()
        assert set(np.diff(np.unique(own))) == {1}
        assert len(np.unique(samples.owner[own])) == 1


def test_what_is_left_out_for_cost_is_left_out_evenly():
    _, hard, every = dealt(table(2))
    _, _, some = dealt(table(2), most=45)
    assert FOLDS < len(some) < 0.6 * len(every)
    quartiles = [np.quantile(means(hard, b), [0, 0.25, 0.5, 0.75, 1]) for b in (every, some)]
    np.testing.assert_allclose(quartiles[0], quartiles[1], rtol=0.25)


def test_few_windows_make_small_blocks_rather_than_few():
    _, _, found = dealt(table(3, runs=1, rows=60), length=6)
    assert len(found) >= 8


@pytest.mark.parametrize("jacobian", [1e200, np.nan])
def test_windows_end_where_the_simulator_runs_away_before_readings_come(jacobian):
    """Rare readings amid samples that tell nothing: products of the Jacobians overflow."""
    seen = np.full((101, 1), np.nan)
    seen[::10] = 1.0
    samples = Samples.join([Trajectory("run", np.arange(101.0), seen, np.zeros((100, 1)))], 1)
    windows = cut(samples, np.full((101, 1, 1), jacobian), np.ones(1), 90.0, shortest=3)
    assert len(windows) == 3
