"""DropoutNet: accuracy, spread, the paper's settings."""

from __future__ import annotations

import numpy as np
import pytest

from residual.dropout_net import DropoutNet


def wave(n, seed=0, noise=0.0):
    random = np.random.default_rng(seed)
    X = random.uniform(-2, 2, (n, 2)) * [1, 50] + [0, 200]
    y = np.stack([np.sin(X[:, 0]), np.cos(X[:, 0]) * (X[:, 1] - 200)], axis=1)
    return X, y + noise * y.std(axis=0) * random.standard_normal(y.shape)


def relative_error(model, X, y):
    return np.sqrt(np.mean((model.predict(X) - y) ** 2, axis=0)) / y.std(axis=0)


def test_more_data_lower_error_by_default_and_not_with_dropout_to_the_end():
    def error(rows, **options):
        model = DropoutNet(hidden=(60, 60), learning_rate=0.01, random_state=0, **options).fit(
            *wave(rows)
        )
        return relative_error(model, *wave(500, seed=1)).mean()

    assert error(1000) < 0.9 * error(100)
    assert error(1000) < 0.6 * error(1000, fine_tuning=0.0)


def test_the_papers_settings_hold_whatever_else_is_said():
    X, y = wave(40)
    plain = DropoutNet(hidden=(8,), paper=True, random_state=0).fit(X, y)
    other = DropoutNet(
        hidden=(8,), paper=True, epochs=1, batch_size=7, learning_rate=1.0, random_state=0
    ).fit(X, y)
    assert np.array_equal(plain.predict(X), other.predict(X))
    plan = plain._plan(3750)
    assert (plan.steps, plan.batch_size, plan.learning_rate) == (300 * 118, 32, 0.02)
    assert (plan.dropout, plan.fine_tuning, plan.decay) == (0.3, 0.0, 0.0)


def test_training_leaves_the_random_state_of_torch_alone():
    import torch

    before = torch.random.get_rng_state()
    DropoutNet(hidden=(8,), random_state=0).fit(*wave(40))
    assert torch.equal(before, torch.random.get_rng_state())


@pytest.mark.parametrize("dropout", [0.0, pytest.param(0.1, marks=pytest.mark.long)])
def test_learns_a_smooth_function(dropout):
    model = DropoutNet(
        hidden=(100, 100),
        dropout=dropout,
        epochs=150,
        batch_size=64,
        learning_rate=0.01,
        random_state=0,
    ).fit(*wave(800))
    assert np.all(relative_error(model, *wave(500, seed=1)) < (0.05 if dropout == 0 else 0.15))


def test_intervals_cover_fresh_rows_of_a_noisy_function():
    for dropout in (0.0, 0.1):
        X, y = wave(1500, noise=0.2)
        model = DropoutNet(
            hidden=(60, 60),
            dropout=dropout,
            epochs=60,
            batch_size=64,
            learning_rate=0.01,
            random_state=0,
        ).fit(X, y)
        probe, fresh = wave(2000, seed=1, noise=0.2)
        mean, std = model.predict(probe, return_std=True)
        assert 0.83 < np.mean(np.abs(fresh - mean) < 1.6449 * std) < 0.96


def test_deviation_grows_away_from_the_data():
    X, y = wave(400, noise=0.05)
    model = DropoutNet(
        hidden=(60, 60), epochs=100, batch_size=64, learning_rate=0.01, random_state=0
    ).fit(X, y)
    inside = model.predict(X, return_std=True)[1].mean(axis=0)
    outside = model.predict(X + np.array([20.0, 1000.0]), return_std=True)[1].mean(axis=0)
    assert np.all(outside > 2 * inside)


def test_few_rows_and_wide_batches_work():
    X, y = wave(3)
    model = DropoutNet(hidden=(8,), epochs=3, batch_size=1000, random_state=0).fit(X, y)
    mean, std = model.predict(X, return_std=True)
    assert np.isfinite(mean).all() and np.all(std > 0)


def test_few_rows_get_more_passes_and_very_many_rows_fewer():
    net = DropoutNet(epochs=30, batch_size=32)
    assert net._plan(40).steps == 600
    assert net._plan(3200).steps == 3000
    assert net._plan(100_000).steps == 8000
