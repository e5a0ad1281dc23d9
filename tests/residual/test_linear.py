"""Linear against closed forms and scikit-learn's ridge regression."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.linear_model import Ridge
from sklearn.preprocessing import PolynomialFeatures, StandardScaler

from residual.linear import Linear


@settings(max_examples=25)
@given(
    seed=st.integers(0, 2**32 - 1),
    rows=st.integers(5, 60),
    alpha=st.floats(1e-3, 1e3),
    features=st.sampled_from(["raw", "quadratic"]),
)
def test_agrees_with_scikit_learns_ridge(seed, rows, alpha, features):
    random = np.random.default_rng(seed)
    X, y = random.normal(3, 2, (rows, 3)), random.normal(-1, 5, (rows, 2))
    probe = random.normal(3, 2, (7, 3))
    ours = Linear(features=features, alpha=alpha).fit(X, y).predict(probe)

    columns = StandardScaler().fit(X)
    powers = PolynomialFeatures(1 if features == "raw" else 2, include_bias=False)
    scaler = StandardScaler()
    phi = scaler.fit_transform(powers.fit_transform(columns.transform(X)))
    theirs = Ridge(alpha=alpha, solver="svd").fit(phi, y)
    expected = theirs.predict(scaler.transform(powers.transform(columns.transform(probe))))
    assert np.allclose(ours, expected, rtol=1e-8, atol=1e-8 * np.abs(y).max())


def test_deviation_is_that_of_bayesian_linear_regression():
    random = np.random.default_rng(0)
    X, probe = random.normal(size=(30, 2)), random.normal(size=(6, 2))
    y = X @ [1.0, -2.0] + random.normal(size=30)
    model = Linear(features="raw", alpha=3.0).fit(X, y)
    std = model.predict(probe, return_std=True)[1]

    center, scale = X.mean(axis=0), X.std(axis=0)
    phi, at = (X - center) / scale, (probe - center) / scale
    precision = phi.T @ phi + 3.0 * np.eye(2)
    target = (y - y.mean()) / y.std()
    noise = target @ np.linalg.solve(np.eye(30) + phi @ phi.T / 3.0, target) / 30
    leverage = np.sum(at * np.linalg.solve(precision, at.T).T, axis=1)
    assert np.allclose(std, y.std() * np.sqrt(noise * (1 + 1 / 30 + leverage)), rtol=1e-6)


def swing(X):
    angle, rate, voltage = X.T
    return np.stack(
        [np.sin(angle) * rate + 0.3 * voltage, np.cos(angle) ** 2 * rate - voltage * rate**2],
        axis=1,
    )


def rows(n, seed, turns=1.0):
    random = np.random.default_rng(seed)
    return random.uniform([-np.pi * turns, -15, -3], [np.pi * turns, 15, 3], (n, 3))


def test_trigonometric_features_recover_a_polynomial_of_cosine_and_sine():
    X, probe = rows(200, 0), rows(100, 1, turns=5)
    model = Linear(degree=3, angles=(0,), scales=(1.0, 10.0, 3.0)).fit(X, swing(X))
    error = model.predict(probe) - swing(probe)
    assert np.all(np.sqrt(np.mean(error**2, axis=0)) < 1e-5 * swing(probe).std(axis=0))


@pytest.mark.parametrize("features", ["raw", "quadratic", "trigonometric"])
def test_whole_turns_of_an_angle_do_not_matter(features):
    X = rows(200, 0)
    model = Linear(features=features, angles=(0,), scales=(1.0, 10.0, 3.0)).fit(X, swing(X))
    for turns in (-3, 1, 20):
        turned = X + np.array([2 * np.pi * turns, 0, 0])
        assert np.allclose(model.predict(turned), model.predict(X), rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("n", [40, 400, 20000])
def test_evidence_finds_the_noise_and_intervals_cover(n):
    random = np.random.default_rng(1)
    X = rows(n, 2)
    noise = 0.2 * swing(X).std(axis=0)
    y = swing(X) + noise * random.standard_normal((n, 2))
    model = Linear(angles=(0,), scales=(1.0, 10.0, 3.0)).fit(X, y)
    probe = rows(2000, 3)
    fresh = swing(probe) + noise * random.standard_normal((2000, 2))
    mean, std = model.predict(probe, return_std=True)
    covered = np.mean(np.abs(fresh - mean) < 1.6449 * std)
    assert (0.8 if n == 40 else 0.87) < covered < (0.99 if n == 40 else 0.93)
    if n > 40:
        assert np.allclose(model.noise_ * y.std(axis=0), noise, rtol=0.15)


def test_degree_is_lowered_until_the_features_are_few_enough():
    random = np.random.default_rng(0)
    y = random.normal(size=30)
    assert Linear().fit(random.normal(size=(30, 3)), y).degree_ == 3
    wide = Linear(angles=tuple(range(7))).fit(random.normal(size=(30, 24)), y)
    assert wide.degree_ == 2
    assert Linear().fit(random.normal(size=(30, 60)), y).degree_ == 1


def test_more_rows_than_a_chunk_give_the_same_as_one_product():
    X = rows(9000, 4)
    y = swing(X) + np.random.default_rng(0).normal(size=(9000, 2))
    chunked = Linear(features="quadratic", alpha=1.0).fit(X, y)
    columns = StandardScaler().fit_transform(X)
    phi = StandardScaler().fit_transform(
        PolynomialFeatures(2, include_bias=False).fit_transform(columns)
    )
    assert np.allclose(chunked.predict(X), Ridge(alpha=1.0).fit(phi, y).predict(phi), rtol=1e-7)


def test_constant_and_repeated_columns_do_no_harm():
    X = rows(100, 5)
    X = np.hstack([X, np.full((100, 1), 7.0), X[:, 1:2]])
    y = 2 * X[:, 1] - X[:, 2]
    mean, std = Linear(features="quadratic").fit(X, y).predict(X, return_std=True)
    assert np.allclose(mean, y, atol=1e-4) and np.isfinite(std).all()
