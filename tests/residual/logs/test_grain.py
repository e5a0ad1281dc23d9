"""The step of an encoder, or the last digit of a print, is read off the values themselves."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from residual.logs.faults import grain, rounding


@given(
    counts=st.lists(st.integers(-5000, 5000), min_size=8, max_size=200, unique=True),
    step=st.sampled_from([1.0, 0.15, 2.5e-5, 2 * np.pi / 2400]),
    zero=st.sampled_from([0.0, 0.3]),
)
@settings(max_examples=100)
def test_all_values_are_whole_steps_apart(counts, step, zero):
    found = grain([zero + step * np.array(counts, float)])
    whole = np.gcd.reduce(np.diff(np.sort(counts)))
    # Of a few readings far apart no step is to be seen.
    assert found == 0 or found / step == pytest.approx(whole, rel=1e-3)
    if np.diff(np.sort(counts)).min() <= 5 * whole:
        assert found > 0


def test_an_encoder_that_was_never_read_one_step_apart():
    """Fast motion: two or three steps and more between samples."""
    counts = np.cumsum([2, 3, 5, 7, 3, 2, 8, 13, 5, 2, 3])
    assert grain([2.5e-5 * counts]) == pytest.approx(2.5e-5, rel=1e-6)


@given(seed=st.integers(0, 1000), size=st.integers(8, 400))
@settings(max_examples=50)
def test_readings_that_were_not_rounded_have_none(seed, size):
    assert grain([np.random.default_rng(seed).standard_normal(size)]) == 0


def test_few_values_in_even_steps_are_all_that_a_sensor_tells():
    held = np.repeat([20.0, 20.5, 21.0, 20.5, 21.0, 21.5, 21.0, 20.5], 40)
    assert rounding([held]) == pytest.approx(0.5)
    assert rounding([held[::40]]) == 0.0  # too few readings
    assert rounding([np.repeat([0.0, 1.0], 200)]) == 0.0  # a valve
    assert rounding([np.repeat([0.0, 1.0, 5.0], 200)]) == 0.0
