"""GaussianProcess against scikit-learn's exact formulas, and its approximation beyond."""

from __future__ import annotations

import numpy as np
import pytest
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, Matern, WhiteKernel

from residual.gaussian_process import GaussianProcess


def wave(n, seed=0, noise=0.0):
    random = np.random.default_rng(seed)
    X = random.uniform(-2, 2, (n, 3)) * [1, 5, 0.1] + [0, 10, 0]
    y = np.stack([np.sin(2 * X[:, 0]) + 10 * X[:, 2], X[:, 0] * X[:, 1]], axis=1)
    return X, y + noise * y.std(axis=0) * random.standard_normal(y.shape)


@pytest.mark.parametrize("kernel", ["rbf", "matern"])
def test_exact_process_agrees_with_scikit_learn_at_the_same_hyperparameters(kernel):
    X, y = wave(150, noise=0.1)
    probe = wave(40, seed=1)[0]
    ours = GaussianProcess(kernel=kernel, calibrate=False, random_state=0).fit(X, y)
    mean, std = ours.predict(probe, return_std=True)
    scale = X.std(axis=0)
    for k in range(2):
        shape = (
            RBF(ours.lengthscale_[k]) if kernel == "rbf" else Matern(ours.lengthscale_[k], nu=2.5)
        )
        peer = GaussianProcessRegressor(
            ConstantKernel(ours.outputscale_[k]) * shape + WhiteKernel(ours.noise_[k]),
            alpha=0.0,
            optimizer=None,
            normalize_y=True,
        ).fit(X / scale, y[:, k])
        expected, spread = peer.predict(probe / scale, return_std=True)
        assert np.allclose(mean[:, k], expected, atol=1e-7 * y[:, k].std())
        assert np.allclose(std[:, k], spread, rtol=1e-6)


@pytest.mark.filterwarnings("ignore:The optimal value found")
def test_its_hyperparameters_are_as_likely_as_scikit_learns():
    X, y = wave(100, noise=0.1)
    ours = GaussianProcess(max_iter=200).fit(X, y)
    scaled = (X - X.mean(axis=0)) / X.std(axis=0)
    for k in range(2):
        target = (y[:, k] - y[:, k].mean()) / y[:, k].std()
        peer = GaussianProcessRegressor(
            ConstantKernel(1.0, (1e-4, 1e4)) * RBF([3**0.5] * 3, (1e-2, 1e3))
            + WhiteKernel(1e-2, (1e-9, 1e1)),
            alpha=0.0,
        ).fit(scaled, target)
        theta = np.log([ours.outputscale_[k], *ours.lengthscale_[k], ours.noise_[k]])
        # Within 1 % of a unit of log likelihood of the peer's optimum.
        assert peer.log_marginal_likelihood(theta) > peer.log_marginal_likelihood_value_ - 0.01


def test_intervals_cover_fresh_rows_of_a_noisy_function():
    for options in ({}, {"max_points": 100, "inducing": 80}):
        X, y = wave(400, noise=0.1)
        model = GaussianProcess(random_state=0, hyper_points=200, **options).fit(X, y)
        probe, fresh = wave(1000, seed=1, noise=0.1)
        mean, std = model.predict(probe, return_std=True)
        assert 0.86 < np.mean(np.abs(fresh - mean) < 1.6449 * std) < 0.94
        assert np.all(np.abs(model.noise_**0.5 - 0.1) < 0.02)


def test_deviation_grows_away_from_the_data():
    X, y = wave(60)
    model = GaussianProcess(random_state=0).fit(X, y)
    inside = model.predict(X, return_std=True)[1]
    outside = model.predict(X + np.array([0, 500, 0]), return_std=True)[1][:, 1]
    assert np.all(outside > 10 * inside[:, 1].max())
    assert np.all(outside < 100 * y[:, 1].std())


def test_a_noise_free_function_is_interpolated():
    X, y = wave(200)
    probe, truth = wave(200, seed=1)
    model = GaussianProcess(random_state=0).fit(X, y)
    error = np.sqrt(np.mean((model.predict(probe) - truth) ** 2, axis=0))
    assert np.all(error < 1e-3 * truth.std(axis=0))
    # Rows given twice make the kernel matrix singular up to the noise floor.
    X, y = X[:100], y[:100]
    twice = GaussianProcess(random_state=0).fit(np.vstack([X, X]), np.vstack([y, y]))
    mean, std = twice.predict(probe, return_std=True)
    assert np.all(np.abs(mean - truth) < 0.1 * truth.std(axis=0)) and np.all(std > 0)


def test_inducing_points_at_all_rows_are_the_exact_process():
    X, y = wave(80, noise=0.1)
    probe = wave(30, seed=1)[0]
    exact = GaussianProcess(random_state=0).fit(X, y)
    model = GaussianProcess(random_state=0, max_points=79, inducing=80).fit(X, y)
    assert exact.exact_ and not model.exact_
    # The bound is the likelihood then, but its best noise is sought on a grid.
    for ours, theirs in zip(
        model.predict(probe, return_std=True), exact.predict(probe, return_std=True), strict=True
    ):
        assert np.all(np.abs(ours - theirs) < 0.02 * y.std(axis=0))


def test_inducing_points_come_close_to_the_exact_process_at_a_fraction_of_the_points():
    X, y = wave(1000)
    probe, truth = wave(300, seed=1)
    model = GaussianProcess(random_state=0, max_points=500, inducing=200, hyper_points=200)
    model.fit(X, y)
    error = np.sqrt(np.mean((model.predict(probe) - truth) ** 2, axis=0))
    assert np.all(error < 0.01 * truth.std(axis=0))
    assert model.points_.shape == (200, 3)


def test_a_failed_factor_is_repaired_and_targets_may_be_constant():
    X = np.repeat(np.linspace(0, 1, 20), 10)[:, None]
    y = np.stack([np.sin(X[:, 0]), np.zeros(200)], axis=1)
    mean, std = GaussianProcess(random_state=0).fit(X, y).predict(X, return_std=True)
    assert np.allclose(mean, y, atol=1e-3) and np.isfinite(std).all()


def jumping(seed, share, rows=1600, inputs=12):
    """Inputs, a smooth function of two of them, and that with jumps of some rows, standardised."""
    rng = np.random.default_rng(seed)
    X = rng.normal(size=(rows, inputs))
    smooth = X[:, 0] + 0.5 * np.sin(2 * X[:, 1])
    y = smooth + (rng.random(rows) < share) * rng.normal(0, 8, rows)
    return X, smooth, (y - y.mean()) / y.std()


@pytest.mark.parametrize("seed", [pytest.param(1, marks=pytest.mark.long), 2])
def test_jumps_do_not_hide_what_is_smooth(seed):
    X, smooth, y = jumping(seed, 0.05)
    model = GaussianProcess(hyper_points=300, random_state=0).fit(X[:1000], y[:1000])
    assert np.corrcoef(model.predict(X[1000:]), smooth[1000:])[0, 1] > 0.9


def test_what_cannot_be_predicted_is_noise():
    X, _, _ = jumping(0, 0.0)
    y = np.random.default_rng(5).standard_t(1.3, len(X))
    y = (y - y.mean()) / y.std()
    model = GaussianProcess(hyper_points=300, random_state=0).fit(X[:1000], y[:1000])
    mean, std = model.predict(X[1000:], return_std=True)
    assert mean.std() < 0.1
    np.testing.assert_allclose(std, y[:1000].std(), rtol=0.05)
