"""Differences from noisy records: smoothed paths, and estimators that read noise themselves."""

from __future__ import annotations

import numpy as np
import pytest

from residual import DifferenceModel, Linear, NamedEffects
from residual.measured import fit_measured
from residual.trajectories import Transitions
from sims.measured import Measurement
from sims.pendulum import Pendulum
from sims.simulator import state_difference


def record(measurement, n=60, seed=0):
    """Measured transitions of the true pendulum pushed about, late readings put back."""
    true, random = Pendulum.true(), np.random.default_rng(seed)
    actions = np.clip(np.cumsum(random.normal(size=(n, 1)), axis=0), -3, 3)
    states = true.rollout(np.array([np.pi, 0.0]), actions)
    seen = np.array([measurement.read(true, state, random) for state in states])
    return Transitions(seen[:-1], actions, seen[1:], np.zeros(n, int)), states


def error(model, states):
    random = np.random.default_rng(1)
    probe = np.repeat(states, 5, axis=0) + random.normal(scale=[0.2, 1], size=(5 * len(states), 2))
    actions = random.uniform(-3, 3, (len(probe), 1))
    gap = state_difference(
        model.state_channels, Pendulum.true().step(probe, actions), Pendulum().step(probe, actions)
    )
    wrong = model.predict(probe, actions) - gap
    return np.sqrt(np.mean(wrong**2, axis=0) / np.mean(gap**2, axis=0)).max()


@pytest.mark.parametrize("seed", [0, 1])
def test_smoothed_paths_err_less_than_one_step_differences(seed):
    measurement = Measurement(noise=(0.01, 0.2))
    data, states = record(measurement, seed=seed)
    plain = DifferenceModel(Linear(degree=2), Pendulum()).fit(data)
    model = DifferenceModel(Linear(degree=2), Pendulum())
    path = fit_measured(model, data, measurement.sigma(Pendulum()))
    assert error(model, states) < 0.65 * error(plain, states)
    raw, smooth = (np.sqrt(np.mean((s - states[:-1]) ** 2, 0)) for s in (data.states, path.states))
    assert np.all(smooth < raw)


def test_rates_need_no_sensor():
    measurement = Measurement(noise=(0.01, 0.2), unmeasured=("rate",))
    data, states = record(measurement, n=100)
    model = DifferenceModel(Linear(degree=2), Pendulum())
    path = fit_measured(model, data, measurement.sigma(Pendulum()))
    assert np.isfinite(path.states).all()
    assert error(model, states) < 0.5


@pytest.mark.long
def test_named_effects_read_the_measured_path_itself():
    measurement = Measurement(noise=(0.01, 0.2))
    data, _ = record(measurement)
    model = DifferenceModel(NamedEffects(), Pendulum())
    assert fit_measured(model, data, measurement.sigma(Pendulum())) is data
    assert [str(effect) for effect in model.fitted().effects_] == ["mass"]


def test_episodes_are_smoothed_each_by_itself():
    measurement = Measurement(noise=(0.01, 0.2))
    parts = [record(measurement, n=30, seed=seed)[0] for seed in (0, 1)]
    data = Transitions.join(parts)
    model = DifferenceModel(Linear(degree=1), Pendulum())
    path = fit_measured(model, data, measurement.sigma(Pendulum()))
    assert np.array_equal(path.episodes, data.episodes)
    assert np.abs(path.states - data.states).max(axis=0) @ [1, 0.1] < 0.3
