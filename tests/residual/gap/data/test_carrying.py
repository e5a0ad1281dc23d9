"""Changes carried along windows, beside products of matrices."""

import numpy as np
import pytest

from residual.gap.data.carrying import MOST, carry, weighted
from residual.gap.data.windows import Windows


def windows_of(count, length, rows):
    begin = np.linspace(0, rows - length, count).astype(int)
    index = begin[:, None] + np.arange(length)
    return Windows(index, np.ones(index.shape, bool), np.zeros(count, int))


@pytest.mark.parametrize("by_place", [False, True])
@pytest.mark.parametrize("begun", [False, True])
def test_a_response_is_the_sum_of_what_acted_times_the_matrices_since(by_place, begun):
    rng = np.random.default_rng(1)
    windows, width = windows_of(5, 7, 40), 3
    jacobians = np.eye(width) + 0.3 * rng.standard_normal((40, width, width))
    start = rng.standard_normal((width, 2))
    acting = rng.standard_normal((5, 7, width, 4) if by_place else (40, width, 4))
    before = rng.standard_normal((5, width, 4)) if begun else None
    found = carry(windows, jacobians, start, acting, before)
    for w, rows in enumerate(windows.index):
        own = before[w] if begun else np.zeros((width, 4))
        now = np.hstack([start, own])
        for k, row in enumerate(rows[:-1]):
            np.testing.assert_allclose(found[w, k], now, rtol=1e-12, atol=1e-12)
            now = jacobians[row] @ now
            now[:, 2:] += acting[w, k] if by_place else acting[row]


def test_what_runs_away_stays_finite():
    windows = windows_of(2, 300, 400)
    jacobians = np.full((400, 2, 2), 50.0) * np.array([[1, 1], [1, -1]])
    found = carry(windows, jacobians, np.eye(2), np.ones((400, 2, 1)))
    assert np.isfinite(found).all() and np.abs(found).max() == MOST
    jacobians[10] = np.nan
    assert np.isfinite(carry(windows, jacobians, np.eye(2), np.ones((400, 2, 1)))).all()


def test_states_are_read_off_with_their_weights():
    rng = np.random.default_rng(2)
    response, weights = rng.standard_normal((3, 4, 5, 6)), rng.standard_normal((3, 4, 2))
    states = np.array([4, 1])
    expected = response[:, :, states] * weights[..., None]
    np.testing.assert_array_equal(weighted(response, states, weights), expected)
