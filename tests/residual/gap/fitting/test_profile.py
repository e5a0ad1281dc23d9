"""Sizes by the profile of a loss: the least of it, and how far luck and blocks move that."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from residual.gap.fitting.impacts.profile import lowest

LINE = np.linspace(-0.16, 0.16, 5)


def parabolas(least, curvature):
    """Losses of windows, each least at its own place, (G, W)."""
    return curvature * (LINE[:, None] - least) ** 2 + 7.0


@given(
    st.floats(-0.5, 0.5),
    st.lists(st.floats(-0.1, 0.1), min_size=8, max_size=8),
    st.lists(st.floats(0.5, 20.0), min_size=8, max_size=8),
)
def test_the_least_is_the_mean_of_the_windows_by_curvature(middle, apart, curvature):
    least, weight = middle + np.array(apart), np.array(curvature)
    found, spread = lowest(LINE, parabolas(least, weight), np.arange(8))
    assert found == pytest.approx((least * weight).sum() / weight.sum(), abs=1e-6)
    assert 0 <= spread < np.inf
    # Whatever unit the loss has, and wherever the line begins.
    again = lowest(LINE + 3.0, 5.0 * parabolas(least, weight), np.arange(8))
    assert again == pytest.approx((found + 3.0, spread), abs=1e-6)


def test_the_spread_is_that_of_blocks():
    rng = np.random.default_rng(0)
    shifts, found = 0.05 * rng.standard_normal((400, 12)), []
    for own in shifts:
        places = np.repeat(own, 3)  # three windows of a block err alike
        found.append(lowest(LINE, parabolas(places, np.ones(36)), np.repeat(np.arange(12), 3)))
    places, spreads = np.array(found).T
    assert np.std(places) == pytest.approx(0.05 / np.sqrt(12), rel=0.1)
    covered = np.abs(places) <= 1.96 * spreads
    assert covered.mean() == pytest.approx(0.95, abs=0.03)


def test_a_loss_without_a_least_value_tells_no_size():
    lost = parabolas(np.zeros(6), np.full(6, -1.0))
    place, spread = lowest(LINE, lost, np.arange(6))
    assert spread == np.inf
    assert place in (LINE[0], LINE[-1])
    # Nor does one of which two sizes can be seen, as between narrow bounds.
    pair = np.array([0.0, 0.1, 0.1])
    assert lowest(pair, pair[:, None] + np.zeros((3, 6)), np.arange(6)) == (0.0, np.inf)
