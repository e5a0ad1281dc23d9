"""A position that stands still at the end of its sensor's range, while the rate goes on."""

import numpy as np
import pytest

from residual.logs.clipped import clipped_samples
from residual.logs.frozen import frozen_samples

DT = 0.01
TIMES = DT * np.arange(200)
#: A joint that is driven on, ever slower, with a sensor that hesitates once.
RATE = 5.0 - 1.5 * TIMES
POSITION = np.cumsum(RATE) * DT


def read(values):
    """With a repeated reading just before the end of the range, as of a slow bus."""
    values = np.round(values, 4)
    end = int(np.argmax(values == values.max()))
    values[end - 4] = values[end - 5]
    return values


def test_a_sensor_at_the_end_of_its_range_is_seen_by_the_rate():
    (marked,) = frozen_samples([read(np.minimum(POSITION, 4.0))], [RATE[:-1] * DT])
    assert np.flatnonzero(marked)[0] == np.argmax(POSITION > 4.0) + 1
    assert marked[-1]


@pytest.mark.parametrize("samples", [0, 4, 7])
def test_a_joint_at_a_stop_is_not_even_if_the_rate_is_filtered(samples):
    stopped = np.minimum(POSITION, 4.0)
    rate = np.gradient(stopped, DT)
    if samples:
        for i in range(1, len(rate)):
            rate[i] = rate[i - 1] + (rate[i] - rate[i - 1]) / samples
    (marked,) = frozen_samples([read(stopped)], [rate[:-1] * DT])
    assert not marked.any()


def gauge(seed, end=6.0):
    """A vessel that is filled and vented slowly beside the noise of its gauge."""
    rng = np.random.default_rng(seed)
    pressure = 4.0 + 2.5 * np.sin(np.arange(3000) / 160.0)
    return np.round(np.minimum(pressure + 0.02 * rng.standard_normal(3000), end), 2)


def test_a_gauge_that_ends_amid_its_noise_is_seen_by_its_rest():
    values = gauge(0)
    (marked,) = clipped_samples([values])
    assert marked.sum() > 0.9 * (values == 6.0).sum() > 500
    assert (values[marked] == 6.0).all()


@pytest.mark.parametrize("seed", range(5))
def test_a_gauge_that_turns_back_by_itself_does_not_end(seed):
    (marked,) = clipped_samples([gauge(seed, end=np.inf)])
    assert not marked.any()


def test_readings_that_rest_at_zero_are_no_end():
    """A flow that is shut off now and then."""
    rng = np.random.default_rng(1)
    flow = np.round(np.abs(np.sin(np.arange(2000) / 100.0)) + 0.02 * rng.standard_normal(2000), 2)
    flow[(np.arange(2000) // 200) % 2 == 1] = 0.0
    (marked,) = clipped_samples([np.maximum(flow, 0.0)])
    assert not marked.any()
