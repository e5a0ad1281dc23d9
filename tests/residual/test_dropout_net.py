"""DropoutNet: gradients, accuracy, spread, stopping."""

from __future__ import annotations

import numpy as np
import pytest

from residual.dropout_net import DropoutNet
from residual.dropout_training import train as train_net


def wave(n, seed=0, noise=0.0):
    random = np.random.default_rng(seed)
    X = random.uniform(-2, 2, (n, 2)) * [1, 50] + [0, 200]
    y = np.stack([np.sin(X[:, 0]), np.cos(X[:, 0]) * (X[:, 1] - 200)], axis=1)
    return X, y + noise * y.std(axis=0) * random.standard_normal(y.shape)


def relative_error(model, X, y):
    return np.sqrt(np.mean((model.predict(X) - y) ** 2, axis=0)) / y.std(axis=0)


def test_one_step_is_adagrad_on_autograds_gradient():
    import torch

    random = np.random.default_rng(0)
    X = random.normal(size=(16, 3)).astype(np.float32)
    y = random.normal(size=(16, 2)).astype(np.float32)

    def train(epochs, dropout):
        generator = np.random.Generator(np.random.SFC64(1))
        return train_net(
            X, y, X[:1], y[:1], generator,
            hidden=(8, 6), dropout=dropout, epochs=epochs, batch_size=16, learning_rate=0.1,
            patience=None,
        )  # fmt: skip

    # The generator draws the initial weights first, layer by layer.
    generator = np.random.Generator(np.random.SFC64(1))
    shapes = [(3, 8), (8,), (8, 6), (6,), (6, 2), (2,)]
    limits = [3**-0.5, 3**-0.5, 8**-0.5, 8**-0.5, 6**-0.5, 6**-0.5]
    start = [
        torch.tensor(generator.uniform(-a, a, shape).astype(np.float32), requires_grad=True)
        for a, shape in zip(limits, shapes, strict=True)
    ]
    order = generator.permutation(16)
    for dropout in (0.0, 0.4):
        values, at = torch.from_numpy(X[order]), 0
        uniform = np.random.Generator(np.random.SFC64(1))
        for a, shape in zip(limits, shapes, strict=True):
            uniform.uniform(-a, a, shape)
        uniform.permutation(16)
        draws = uniform.random((16, 14), dtype=np.float32)
        for layer, width in enumerate((8, 6)):
            values = torch.relu(values @ start[2 * layer] + start[2 * layer + 1])
            mask = torch.from_numpy(draws[:, at : at + width] >= dropout)
            values, at = values * mask / (1 - dropout), at + width
        output = values @ start[4] + start[5]
        loss = torch.nn.functional.mse_loss(output, torch.from_numpy(y[order]))
        gradients = torch.autograd.grad(loss, start)
        weights, biases, epochs = train(1, dropout)
        assert epochs == 1
        ours = [part for pair in zip(weights, biases, strict=True) for part in pair]
        optimiser = torch.optim.Adagrad(parts := [p.detach().clone() for p in start], lr=0.1)
        for part, gradient in zip(parts, gradients, strict=True):
            part.grad = gradient
        optimiser.step()
        for mine, theirs in zip(ours, parts, strict=True):
            # A gradient that is only rounding may have either sign, and AdaGrad's first step
            # is as long as any: compare where there is a gradient.
            assert np.allclose(mine, theirs.numpy(), atol=2e-3)


@pytest.mark.parametrize("dropout", [0.0, 0.1])
def test_learns_a_smooth_function(dropout):
    model = DropoutNet(
        hidden=(100, 100), dropout=dropout, epochs=150, batch_size=64, random_state=0
    ).fit(*wave(800))
    assert np.all(relative_error(model, *wave(500, seed=1)) < (0.05 if dropout == 0 else 0.15))


def test_intervals_cover_fresh_rows_of_a_noisy_function():
    for dropout in (0.0, 0.1):
        X, y = wave(1500, noise=0.2)
        model = DropoutNet(
            hidden=(60, 60), dropout=dropout, epochs=60, batch_size=64, random_state=0
        ).fit(X, y)
        probe, fresh = wave(2000, seed=1, noise=0.2)
        mean, std = model.predict(probe, return_std=True)
        assert 0.83 < np.mean(np.abs(fresh - mean) < 1.6449 * std) < 0.96


def test_deviation_grows_away_from_the_data():
    X, y = wave(400, noise=0.05)
    model = DropoutNet(hidden=(60, 60), epochs=100, batch_size=64, random_state=0).fit(X, y)
    inside = model.predict(X, return_std=True)[1].mean(axis=0)
    outside = model.predict(X + np.array([20.0, 1000.0]), return_std=True)[1].mean(axis=0)
    assert np.all(outside > 2 * inside)


def test_patience_stops_early_and_returns_the_best_weights():
    X, y = wave(200, noise=0.5)
    options = {"hidden": (60, 60), "dropout": 0.0, "batch_size": 32, "random_state": 0}
    stopped = DropoutNet(epochs=500, patience=5, **options).fit(X, y)
    assert 5 < stopped.epochs_ < 500
    exhausted = DropoutNet(epochs=stopped.epochs_, **options).fit(X, y)
    assert np.mean(stopped.validation_error_) <= np.mean(exhausted.validation_error_)


def test_few_rows_and_wide_batches_work():
    X, y = wave(3)
    model = DropoutNet(hidden=(8,), epochs=3, batch_size=1000, random_state=0).fit(X, y)
    mean, std = model.predict(X, return_std=True)
    assert np.isfinite(mean).all() and np.all(std > 0)


def test_rescaling_removes_the_shrinkage_that_dropout_leaves():
    X, y = wave(800)
    options = {"hidden": (100, 100), "epochs": 100, "batch_size": 64, "random_state": 0}
    plain = DropoutNet(**options).fit(X, y)
    rescaled = DropoutNet(rescale=True, **options).fit(X, y)
    probe, truth = wave(500, seed=1)
    assert np.all(relative_error(rescaled, probe, truth) < relative_error(plain, probe, truth))
    slopes = [np.polyfit(rescaled.predict(X)[:, k], y[:, k], 1)[0] for k in range(2)]
    assert np.allclose(slopes, 1, atol=0.05)


def test_very_many_rows_take_no_more_steps(monkeypatch):
    monkeypatch.setattr("residual.dropout_net._ALL_EPOCHS", 400)
    X = np.random.default_rng(0).normal(size=(1000, 1))
    options = {"hidden": (2,), "epochs": 9, "batch_size": 100, "random_state": 0}
    # A tenth of the rows is held out.
    assert DropoutNet(**options).fit(X, X).epochs_ == 4
    assert DropoutNet(**options).fit(X[:400], X[:400]).epochs_ == 9
