"""Intervals checked by leaving out neighbourhoods."""

import numpy as np
import pytest
from scipy.linalg import cholesky

from residual.calibration import left_out, neighbourhoods, spread_factor
from residual.gaussian_process import GaussianProcess


def test_left_out_rows_are_predicted_as_by_a_process_without_them():
    random = np.random.default_rng(0)
    X = random.uniform(-2, 2, (120, 2))
    kernel = np.exp(-0.5 * ((X[:, None] - X) ** 2).sum(axis=2)) + 1e-4 * np.eye(120)
    y = np.sin(X.sum(axis=1))
    folds = neighbourhoods(X, np.random.RandomState(0))
    assert np.array_equal(np.sort(np.concatenate(folds)), np.arange(120))
    errors, variances = left_out(cholesky(kernel, lower=True), np.linalg.solve(kernel, y), folds)
    start = 0
    for rows in folds:
        kept = np.setdiff1d(np.arange(120), rows)
        gain = np.linalg.solve(kernel[np.ix_(kept, kept)], kernel[np.ix_(kept, rows)]).T
        variance = np.diag(kernel[np.ix_(rows, rows)] - gain @ kernel[np.ix_(kept, rows)])
        part = slice(start, start := start + len(rows))
        assert np.allclose(errors[part], y[rows] - gain @ y[kept], atol=1e-8)
        assert np.allclose(variances[part], variance, atol=1e-8)


@pytest.mark.parametrize("wrong_by", [0.25, 1.0, 4.0])
def test_the_factor_undoes_what_a_spread_is_wrong_by(wrong_by):
    random = np.random.default_rng(1)
    spread = random.uniform(0.5, 2.0, 20_000)
    errors = spread * random.standard_normal(20_000)
    factor = spread_factor(errors, (spread * wrong_by) ** 2, 0.0)
    assert factor == pytest.approx(1 / wrong_by, rel=0.02)


def test_observation_noise_is_not_scaled():
    random = np.random.default_rng(2)
    errors = np.sqrt(0.3**2 + 0.25) * random.standard_normal(20_000)
    assert spread_factor(errors, np.full(20_000, 0.1**2), 0.25) == pytest.approx(3.0, rel=0.15)


@pytest.mark.parametrize(
    "function", [pytest.param("smooth", marks=pytest.mark.long), "with a corner"]
)
def test_intervals_in_holes_and_at_the_rim_of_the_data_are_about_right(function):
    def truth(X):
        if function == "smooth":
            return np.sin(3 * X[:, :1]) * np.exp(-(X[:, 1:] ** 2))
        return np.abs(X[:, :1]) + 0.3 * np.tanh(5 * X[:, 1:])

    covered = {True: [], False: []}
    for seed in range(2):
        random = np.random.default_rng(seed)
        X, holes = random.uniform(-2, 2, (400, 2)), random.uniform(-1.5, 1.5, (4, 2))
        X = X[np.linalg.norm(X[:, None] - holes, axis=2).min(axis=1) > 0.4][:300]
        probe = random.uniform(-2.4, 2.4, (600, 2))
        for calibrate, shares in covered.items():
            model = GaussianProcess(hyper_points=150, calibrate=calibrate, random_state=seed)
            mean, std = model.fit(X, truth(X)).predict(probe, return_std=True)
            shares.append(np.mean(np.abs(mean - truth(probe)) <= 1.6449 * std))
    off = {key: abs(np.mean(shares) - 0.9) for key, shares in covered.items()}
    assert off[True] < 0.08 and off[True] < off[False], covered
