"""What sensors show, and the state that a filter makes of it."""

from __future__ import annotations

import numpy as np
import pytest

from sims.environment import SimulatorEnv
from sims.measured import MeasuredEnv, Measurement
from sims.pendulum import Pendulum
from sims.tasks import SwingUp


def run(measurement, true=None, steps=120, seed=0):
    """Estimated and true states (T + 1, 2), and readings."""
    env = MeasuredEnv(SimulatorEnv(true or Pendulum(), SwingUp()), Pendulum(), measurement)
    observation, info = env.reset(seed=seed)
    rows = [(observation, info["state"], info["measured"])]
    random = np.random.default_rng(seed)
    for _ in range(steps):
        observation, _, _, _, info = env.step(random.uniform(-3, 3, 1))
        rows.append((observation, info["state"], info["measured"]))
    seen, states, readings = (np.array(part) for part in zip(*rows, strict=True))
    angle = np.arctan2(seen[:, 1], seen[:, 0])
    return np.stack([angle, 10 * seen[:, 2]], axis=1), states, readings


def error(measurement, **options):
    estimated, states, _ = run(measurement, **options)
    apart = estimated - states
    apart[:, 0] = (apart[:, 0] + np.pi) % (2 * np.pi) - np.pi
    return np.sqrt(np.mean(apart**2, axis=0))


def test_without_error_the_state_is_seen():
    assert not Measurement()
    assert np.all(error(Measurement(noise=(0.0, 1e-9))) < 1e-3)


def test_the_filter_is_no_worse_than_the_reading():
    measurement = Measurement(noise=(0.05, 1.0))
    _, states, readings = run(measurement)
    raw = np.sqrt(np.mean((readings - states) ** 2, axis=0))
    assert np.allclose(raw, measurement.noise, rtol=0.2)
    assert np.all(error(measurement) < 0.9 * raw)


def test_rates_are_told_by_angles_and_a_late_reading_is_carried_on():
    assert np.all(error(Measurement(noise=(0.01, 0.2), unmeasured=("rate",))) < [0.02, 0.6])
    late = Measurement(noise=(0.01, 0.2), delay=1)
    _, states, readings = run(late)
    assert np.abs(readings[1:] - states[:-1]).max() < 1.0
    assert np.all(error(late) < [0.02, 0.4])
    # Another pendulum than the one the filter knows.
    assert np.all(error(late, true=Pendulum.true()) < [0.12, 2.5])


def test_readings_have_steps():
    _, states, readings = run(Measurement(steps=(0.1, 0.0)))
    assert np.allclose(readings[:, 0] / 0.1, np.round(readings[:, 0] / 0.1), atol=1e-9)
    assert np.abs(readings - states).max() <= 0.05 + 1e-9


def test_the_same_seed_reads_the_same():
    measurement = Measurement(noise=(0.01, 0.2))
    assert np.array_equal(run(measurement)[2], run(measurement)[2])
    assert not np.array_equal(run(measurement)[2], run(measurement, seed=1)[2])


@pytest.mark.parametrize(
    ("measurement", "message"),
    [
        (Measurement(noise=(0.1,)), r"measure.noise is \[0.1\], .* each of angle, rate"),
        (Measurement(steps=(0.1, -1.0)), "measure.steps"),
        (Measurement(unmeasured=("speed",)), "no state channel speed, only angle, rate"),
        (Measurement(unmeasured=("angle", "rate")), "at least one state channel"),
        (Measurement(delay=-1), "measure.delay is -1"),
    ],
)
def test_what_does_not_fit_is_named(measurement, message):
    with pytest.raises(ValueError, match=message):
        measurement.check(Pendulum())
