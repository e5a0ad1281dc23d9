import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from policy.noise import OrnsteinUhlenbeck


@pytest.mark.parametrize(("sigma", "theta"), [(0.12, 0.15), (0.2, 0.5), (0.1, 1.0)])
def test_statistics_are_those_of_the_process(sigma, theta):
    noise = OrnsteinUhlenbeck(2, sigma, theta, 0)
    values = np.array([noise() for _ in range(60_000)])[100:]
    deviation = sigma / np.sqrt(theta * (2 - theta))
    np.testing.assert_allclose(values.std(0), deviation, rtol=0.05)
    np.testing.assert_allclose(values.mean(0), 0, atol=0.05 * deviation / theta)
    for lag in (1, 5):
        found = np.corrcoef(values[lag:, 0], values[:-lag, 0])[0, 1]
        assert found == pytest.approx((1 - theta) ** lag, abs=0.05)
    assert abs(np.corrcoef(values.T)[0, 1]) < 0.05


@given(st.integers(0, 2**32 - 1), st.integers(1, 6))
def test_same_seed_same_noise_and_reset_forgets(seed, size):
    first, second = (OrnsteinUhlenbeck(size, rng=seed) for _ in range(2))
    np.testing.assert_array_equal([first() for _ in range(5)], [second() for _ in range(5)])
    first.reset()
    fresh = np.random.default_rng(seed)
    fresh.standard_normal((5, size))
    np.testing.assert_array_equal(first(), 0.12 * fresh.standard_normal(size))


@pytest.mark.parametrize(("sigma", "theta"), [(-1, 0.15), (0.1, 0), (0.1, 1.5)])
def test_impossible_settings_are_refused(sigma, theta):
    with pytest.raises(ValueError, match="expected"):
        OrnsteinUhlenbeck(1, sigma, theta)
