"""A rate that was computed from a position tells nothing of its own; an independent sensor does."""

import numpy as np
import pytest
from scipy.signal import lfilter

from residual.logs.derived import differenced, summed_up

STEP = 0.01
T = np.arange(0, 20, STEP)
MOTION = 1.1 * np.exp(-0.05 * T) * np.cos(9 * T)
SPEED = np.gradient(MOTION, STEP)
GRID = 2 * np.pi / 2400
ENCODER = np.round(MOTION / GRID) * GRID


def filtered(x):
    return lfilter([0.3], [1, -0.7], np.diff(x, prepend=x[0]) / STEP)


COMPUTED = {
    "backward": lambda x: np.diff(x, prepend=x[0]) / STEP,
    "forward": lambda x: np.diff(x, append=x[-1]) / STEP,
    "central": lambda x: np.gradient(x, STEP),
    "filtered": filtered,
    "printed": lambda x: np.round(np.gradient(x, STEP), 2),
}


def ask(function, x, v):
    return function([x], [v], [np.full(len(x) - 1, STEP)])


@pytest.mark.parametrize("how", COMPUTED)
def test_differences_of_an_encoder_are_no_measurement(how):
    assert ask(differenced, ENCODER, COMPUTED[how](ENCODER))


@pytest.mark.parametrize("noise", [0.003, 0.05, 0.5])
def test_a_sensor_of_its_own_is_one(noise):
    rng = np.random.default_rng(0)
    gyro = SPEED + noise * rng.standard_normal(len(T))
    assert not ask(differenced, ENCODER, gyro)
    assert not ask(summed_up, ENCODER, gyro)


@pytest.mark.parametrize("digits", [12, 5])
def test_a_sum_of_a_rate_is_the_positions_fault(digits):
    gyro = SPEED + 0.05 * np.random.default_rng(1).standard_normal(len(T))
    summed = np.round(np.cumsum(gyro) * STEP, digits)
    assert ask(summed_up, summed, gyro)
    assert not ask(differenced, summed, gyro)


def test_states_of_a_simulator_are_taken_as_they_are():
    assert not ask(differenced, MOTION, SPEED)


def test_cuts_and_missing_samples_do_not_matter():
    rate = COMPUTED["central"](ENCODER)
    rate[::17] = np.nan
    runs = [slice(0, 700), slice(700, 703), slice(703, 2000)]
    parts = [[v[run] for run in runs] for v in (ENCODER, rate)]
    assert differenced(*parts, [np.full(len(v) - 1, STEP) for v in parts[0]])
