"""How well the share of a gap is known that a model leaves."""

import numpy as np
import pytest

from residual.accuracy import interval_over_rollouts

LENGTHS = [40, 55, 70, 30, 60]


def drawn(rng, spread):
    """Errors and gaps of five rollouts, whose sizes differ from one to the next."""
    errors, gaps = [], []
    for length in LENGTHS:
        size, share = np.exp(spread * rng.standard_normal(2))
        gaps.append(size * rng.standard_normal((length, 1)))
        errors.append(0.2 * share * size * rng.standard_normal((length, 1)))
    return np.concatenate(errors), np.concatenate(gaps)


@pytest.mark.parametrize("spread", [0.0, 0.3])
def test_the_interval_holds_the_share_of_endless_rollouts(spread):
    rng = np.random.default_rng(0)
    squares = np.exp(2 * spread * rng.standard_normal((200_000, 2)))
    true = 0.2 * np.sqrt((squares[:, 0] * squares[:, 1]).mean() / squares[:, 0].mean())
    found = [interval_over_rollouts(["x"], *drawn(rng, spread), LENGTHS)["x"] for _ in range(400)]
    held = np.mean([low <= true <= high for low, high in found])
    assert 0.88 <= held <= 0.99


def test_one_rollout_that_fell_makes_it_wide():
    rng = np.random.default_rng(1)
    errors, gaps = drawn(rng, 0.0)
    low, high = interval_over_rollouts(["x"], errors, gaps, LENGTHS)["x"]
    assert 0.15 < low < 0.2 < high < 0.26
    errors[-60:] *= 20
    low, high = interval_over_rollouts(["x"], errors, gaps, LENGTHS)["x"]
    assert low < 0.5 and high > 5


def test_there_is_none_of_two_rollouts_or_where_nothing_differs():
    one = np.ones((6, 2)) * [1.0, 0.0]
    assert interval_over_rollouts(["x", "y"], one, one, [3, 3]) == {}
    found = interval_over_rollouts(["x", "y"], one, one, [2, 2, 2])
    assert found == {"x": (pytest.approx(1), pytest.approx(1))}
