"""Ensembles: any regressor, a spread that covers, differences of a simulator."""

from __future__ import annotations

import numpy as np
import pytest
from sklearn.ensemble import ExtraTreesRegressor
from sklearn.linear_model import BayesianRidge, LinearRegression
from sklearn.neural_network import MLPRegressor
from sklearn.svm import SVR
from sklearn.tree import DecisionTreeRegressor
from sklearn.utils.estimator_checks import parametrize_with_checks

from residual import DifferenceModel, Ensemble, Linear
from residual.trajectories import Transitions
from sims.pendulum import Pendulum


def wave(n, seed=0, noise=0.2):
    random = np.random.default_rng(seed)
    X = random.uniform(-2, 2, (n, 2))
    y = np.stack([np.sin(X[:, 0]), 50 * np.cos(X[:, 0]) * X[:, 1]], axis=1)
    return X, y + noise * y.std(axis=0) * random.standard_normal(y.shape)


@parametrize_with_checks([Ensemble(DecisionTreeRegressor(max_depth=4), n=3, random_state=0)])
def test_scikit_learn_checks(estimator, check):
    check(estimator)


@pytest.mark.parametrize(
    "regressor",
    [DecisionTreeRegressor(min_samples_leaf=8), SVR(), Linear(degree=3)],
    ids=lambda r: type(r).__name__,
)
def test_intervals_cover_fresh_rows(regressor):
    model = Ensemble(regressor, n=5, random_state=0).fit(*wave(600))
    X, y = wave(2000, seed=1)
    mean, std = model.predict(X, return_std=True)
    assert 0.8 < np.mean(np.abs(y - mean) < 1.6449 * std) < 0.98
    assert np.array_equal(mean, model.predict(X))


def test_the_mean_errs_less_than_one_copy():
    tree = DecisionTreeRegressor(random_state=0)
    X, y = wave(2000, seed=1, noise=0.0)
    alone, many = (
        np.mean((model.fit(*wave(300)).predict(X) - y) ** 2, axis=0)
        for model in (tree, Ensemble(DecisionTreeRegressor(), n=10, random_state=0))
    )
    assert np.all(many < 0.8 * alone)


def test_seeds_alone_make_copies_differ_where_there_are_no_data():
    net = MLPRegressor(
        hidden_layer_sizes=(20,), solver="lbfgs", max_iter=50, max_fun=10**6, tol=0.1
    )
    X, y = wave(100, noise=0.0)
    model = Ensemble(net, n=3, bootstrap=False, random_state=0).fit(X, y)
    near, far = (model.predict(rows, return_std=True)[1].mean() for rows in (X, X + 6))
    assert far > 2 * near
    again = Ensemble(net, n=3, bootstrap=False, random_state=0).fit(X, y)
    assert np.array_equal(model.predict(X), again.predict(X))
    same = Ensemble(LinearRegression(), n=3, bootstrap=False).fit(X, y)
    assert np.allclose(same._means(X).std(axis=0), 0)


@pytest.mark.parametrize("regressor", [ExtraTreesRegressor(20), BayesianRidge(), Linear()])
def test_an_ensemble_learns_a_difference(regressor):
    random = np.random.default_rng(0)
    states, actions = random.uniform([-3, -10], [3, 10], (300, 2)), random.uniform(-3, 3, (300, 1))
    data = Transitions(
        states, actions, Pendulum.true().step(states, actions), np.zeros(300, dtype=int)
    )
    model = DifferenceModel(Ensemble(regressor, random_state=0), Pendulum()).fit(data)
    assert model.raw == isinstance(regressor, Linear)
    gap = data.next_states - Pendulum().step(states, actions)
    mean, std = model.predict(states, actions, return_std=True)
    assert np.sqrt(np.mean((mean - gap) ** 2) / np.mean(gap**2)) < 0.6
    assert std.shape == mean.shape and np.all(std > 0)


def test_one_copy_is_no_ensemble():
    with pytest.raises(ValueError, match="n=1: an ensemble needs at least 2 copies"):
        Ensemble(n=1).fit(*wave(20))
