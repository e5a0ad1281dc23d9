"""Angles go on over whole turns."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from residual.angles import unwrapped
from sims.simulator import wrap

TIMES = np.arange(200) * 0.1


def turning(fastest, seed):
    """Angle and rate of what turns at up to so many rad/s, both ways."""
    rng = np.random.default_rng(seed)
    sizes, phases = rng.uniform(0.5, 1, 3), rng.uniform(0, 6, 3)
    slow = 0.3 * np.array([1, 1.7, 2.3])
    waves = slow[:, None] * TIMES + phases[:, None]
    rate = (sizes[:, None] * np.cos(waves)).sum(0)
    scale = fastest / np.abs(rate).max()
    return scale * (sizes / slow) @ np.sin(waves), scale * rate


@given(st.floats(1, 300), st.integers(0, 99))
def test_a_rate_leads_over_many_turns(fastest, seed):
    angle, rate = turning(fastest, seed)
    found = unwrapped(wrap(angle), TIMES, rate + 0.2)
    np.testing.assert_allclose(np.diff(found), np.diff(angle), atol=1e-9)


@given(st.floats(1, 25), st.integers(0, 99), st.sampled_from([57.3, -1.0, 0.0, np.nan]))
def test_a_rate_that_is_none_changes_nothing(fastest, seed, factor):
    angle, rate = turning(fastest, seed)
    found = unwrapped(wrap(angle), TIMES, factor * rate)
    np.testing.assert_allclose(np.diff(found), np.diff(angle), atol=1e-9)


@given(st.floats(1, 300), st.integers(0, 99), st.integers(1, 198), st.sampled_from([1e3, -80.0]))
def test_a_single_wild_reading_of_the_rate_leads_nowhere(fastest, seed, row, wild):
    angle, rate = turning(fastest, seed)
    rate[row] = wild
    found = unwrapped(wrap(angle), TIMES, rate)
    np.testing.assert_allclose(np.diff(found), np.diff(angle), atol=1e-9)


def test_rows_without_an_angle_stay_so():
    angle, rate = turning(40.0, 0)
    seen = wrap(angle)
    seen[[0, 50, 51]] = np.nan
    found = unwrapped(seen, TIMES, rate)
    assert np.isnan(found[[0, 50, 51]]).all()
    np.testing.assert_allclose(found[199] - found[1], angle[199] - angle[1])


@pytest.mark.parametrize("count", [0, 1])
def test_of_fewer_than_two_rows_nothing_is_to_be_done(count):
    assert unwrapped(np.ones(count), np.ones(count), np.ones(count)).tolist() == [1.0] * count


@given(st.floats(0.1, 3.0), st.integers(0, 99), st.integers(40, 150))
def test_what_goes_beyond_a_turn_was_not_cut_and_keeps_its_jumps(beyond, seed, row):
    angle, rate = turning(20.0, seed)
    held = angle.copy()
    held[row : row + 9] = held[row]  # a reading that stands still, and jumps on
    held[row + 9 :] += (np.pi + beyond) * np.sign(rate[row])
    assert np.array_equal(unwrapped(held, TIMES, rate), held)
