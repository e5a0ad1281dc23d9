"""The contract that all estimators of ours share: scikit-learn's, and what goes beyond it."""

from __future__ import annotations

import dataclasses
import subprocess
import sys

import numpy as np
import pandas
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.base import clone
from sklearn.cluster import KMeans
from sklearn.compose import TransformedTargetRegressor
from sklearn.cross_decomposition import PLSRegression
from sklearn.ensemble import IsolationForest
from sklearn.exceptions import NotFittedError
from sklearn.linear_model import LogisticRegression, Ridge
from sklearn.model_selection import GridSearchCV
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils.estimator_checks import parametrize_with_checks

from residual.dropout_net import DropoutNet
from residual.ensemble import Ensemble
from residual.estimator import NotFinite, check_regressor
from residual.features import ChannelFeatures
from residual.gaussian_process import GaussianProcess
from residual.linear import Linear
from residual.named_effects import NamedEffects
from sims.simulator import Simulator

CHECKED = [
    Linear(),
    Linear(features="raw"),
    Linear(features="quadratic", alpha=1.0),
    GaussianProcess(max_iter=5, random_state=0),
    DropoutNet(
        hidden=(32, 32), dropout=0.05, epochs=30, batch_size=32, learning_rate=0.01, random_state=0
    ),
    ChannelFeatures(),
]
VARIANTS = [
    GaussianProcess(max_iter=5, max_points=30, inducing=20, kernel="matern", random_state=0),
    DropoutNet(hidden=(32,), dropout=0.0, epochs=30, batch_size=32, paper=True, random_state=0),
]


@pytest.fixture(autouse=True)
def short_training(monkeypatch):
    """Networks take 150 gradient steps at most: what is held here is no matter of how many."""
    plan = DropoutNet._plan

    def brief(net, rows):
        planned = plan(net, rows)
        return dataclasses.replace(planned, steps=min(planned.steps, 150))

    monkeypatch.setattr(DropoutNet, "_plan", brief)


@parametrize_with_checks(CHECKED)
def test_scikit_learn_checks(estimator, check):
    check(estimator)


@pytest.mark.long
@parametrize_with_checks(VARIANTS)
def test_scikit_learn_checks_of_variants(estimator, check):
    check(estimator)


def small() -> list:
    return [
        Linear(degree=2),
        GaussianProcess(max_iter=20, random_state=0),
        GaussianProcess(max_iter=20, max_points=50, inducing=30, random_state=0),
        DropoutNet(hidden=(40, 40), epochs=20, batch_size=32, learning_rate=0.01, random_state=0),
    ]


def few() -> list:
    linear, exact, induced, net = small()
    return [linear, exact, pytest.param(induced, marks=pytest.mark.long), net]


def wave(n: int, seed: int = 0, noise: float = 0.0):
    random = np.random.default_rng(seed)
    X = random.uniform(-2, 2, (n, 3))
    y = np.stack([np.sin(X[:, 0]) + X[:, 1], 100 * X[:, 1] * X[:, 2] + 7], axis=1)
    return X, y + noise * y.std(axis=0) * random.standard_normal(y.shape)


@pytest.fixture(scope="module", params=small(), ids=lambda e: type(e).__name__)
def fitted(request):
    return clone(request.param).fit(*wave(120, noise=0.05))


def test_a_row_has_the_same_bits_alone_and_in_any_batch(fitted):
    X = wave(37, seed=1)[0]
    together = fitted.predict(X)
    order = np.random.default_rng(2).permutation(len(X))
    assert np.array_equal(fitted.predict(X[order]), together[order])
    assert np.array_equal(np.vstack([fitted.predict(row[None]) for row in X]), together)
    assert np.array_equal(fitted.predict(X[3:17]), together[3:17])


def test_predict_is_repeatable_and_leaves_its_input_alone(fitted):
    X = wave(9, seed=1)[0]
    before = X.copy()
    first, second = fitted.predict(X, return_std=True), fitted.predict(X, return_std=True)
    assert np.array_equal(first, second)
    assert np.array_equal(first[0], fitted.predict(X))
    assert np.array_equal(X, before)


@pytest.mark.parametrize("estimator", small(), ids=lambda e: type(e).__name__)
def test_same_seed_same_bits_whatever_the_global_generators_hold(estimator):
    import torch

    X, y = wave(80)
    threads = torch.get_num_threads()
    predictions = []
    for state in (1, 2):
        np.random.seed(state)  # noqa: NPY002
        torch.manual_seed(state)
        global_numpy, global_torch = np.random.get_state()[1], torch.get_rng_state()  # noqa: NPY002
        predictions.append(clone(estimator).fit(X, y).predict(X, return_std=True))
        assert np.array_equal(np.random.get_state()[1], global_numpy)  # noqa: NPY002
        assert torch.equal(torch.get_rng_state(), global_torch)
    assert np.array_equal(*predictions)
    assert torch.get_num_threads() == threads
    assert torch.get_default_dtype() == torch.float32


@pytest.mark.parametrize("estimator", few(), ids=lambda e: type(e).__name__)
@settings(max_examples=3)
@given(
    scale=st.floats(1e-3, 1e3), shift=st.floats(-1e2, 1e2), unit=st.sampled_from([1e-3, 1.0, 1e4])
)
def test_predictions_carry_the_units_of_the_targets(estimator, scale, shift, unit):
    X, y = wave(60)
    probe = wave(15, seed=3)[0]
    mean, std = clone(estimator).fit(X, y).predict(probe, return_std=True)
    other = clone(estimator).fit(unit * X, scale * y + shift)
    other_mean, other_std = other.predict(unit * probe, return_std=True)
    tolerance = 2e-2 * y.std(axis=0)
    assert np.all(np.abs((other_mean - shift) / scale - mean) < tolerance)
    assert np.all(np.abs(other_std / scale - std) < tolerance)


def test_one_dimensional_targets_give_one_dimensional_predictions():
    X, y = wave(40)
    for estimator in small():
        flat = clone(estimator).fit(X, y[:, 0])
        column = clone(estimator).fit(X, y[:, :1])
        mean, std = flat.predict(X, return_std=True)
        assert mean.shape == std.shape == (40,)
        assert np.array_equal(column.predict(X), mean[:, None])


def test_every_way_to_give_a_row_gives_the_same_prediction(fitted):
    X = wave(6, seed=5)[0].round(2)
    expected = fitted.predict(X)
    assert np.array_equal(fitted.predict(X.tolist()), expected)
    assert np.array_equal(fitted.predict(np.asfortranarray(X)), expected)
    assert np.array_equal(fitted.predict(np.repeat(X, 2, axis=0)[::2]), expected)


def test_wrong_rows_get_scikit_learns_errors(fitted):
    X = wave(4)[0]
    with pytest.raises(ValueError, match=r"4 features, but .* is expecting 3 features"):
        fitted.predict(np.zeros((2, 4)))
    with pytest.raises(ValueError, match="Expected 2D array"):
        fitted.predict(X[0])
    with pytest.raises(ValueError, match="contains NaN"):
        fitted.predict(np.full((1, 3), np.nan))
    with pytest.raises(ValueError, match="infinity"):
        fitted.predict(np.full((1, 3), np.inf))
    with pytest.raises(NotFittedError):
        clone(fitted).predict(X)


def test_column_names_are_remembered():
    X, y = wave(40)
    estimator = Linear(degree=1).fit(pandas.DataFrame(X, columns=["a", "b", "c"]), y)
    with pytest.raises(ValueError, match="feature names should match"):
        estimator.predict(pandas.DataFrame(X, columns=["a", "b", "d"]))
    with pytest.warns(UserWarning, match="valid feature names"):
        estimator.predict(X)


@pytest.mark.parametrize(
    ("estimator", "message"),
    [
        (Linear(features="cubic"), "features='cubic': choose one of raw"),
        (Linear(degree=0), "degree=0"),
        (Linear(alpha=-1.0), "alpha=-1.0"),
        (Linear(angles=(5,)), r"angles=\(5,\) does not fit X with 3 columns"),
        (Linear(scales=(1.0,)), r"scales=\(1.0,\) does not fit X with 3 columns"),
        (GaussianProcess(kernel="periodic"), "kernel='periodic': choose one of rbf, matern"),
        (GaussianProcess(inducing=0), "inducing=0"),
        (DropoutNet(dropout=1.0), "dropout=1.0"),
        (DropoutNet(hidden=()), "hidden="),
        (DropoutNet(learning_rate=0.0), "learning_rate=0.0"),
        (DropoutNet(epochs=0), "epochs=0"),
        (DropoutNet(validation_fraction=1.0), "validation_fraction=1.0"),
    ],
)
def test_a_wrong_argument_is_named_when_fitting(estimator, message):
    with pytest.raises(ValueError, match=message):
        estimator.fit(*wave(20))


def test_importing_linear_loads_neither_torch_nor_gpytorch():
    code = "import sys, residual.linear; print('torch' in sys.modules, 'gpytorch' in sys.modules)"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.split() == ["False", "False"]


HUGE = np.tile([-1e308, 1e308], 10)


@pytest.mark.parametrize("make", [Linear, lambda: GaussianProcess(max_iter=2)])
def test_values_whose_spread_overflows_are_refused(make):
    X = np.random.default_rng(0).normal(size=(20, 2))
    with pytest.raises(ValueError, match=r"column 0 of y runs from .* overflows"):
        make().fit(X, HUGE)
    with pytest.raises(ValueError, match=r"column 1 of X runs from .* overflows"):
        make().fit(np.column_stack([X[:, 0], HUGE]), X)


def test_no_prediction_is_ever_nan():
    X = np.random.default_rng(0).normal(size=(20, 2))
    model = Linear("quadratic").fit(X, X[:, 0])
    with pytest.raises(NotFinite, match=r"no finite number for 1 of 2 rows.*1e\+200"):
        model.predict([[0.0, 0.0], [1e200, -1e200]])
    assert np.isfinite(model.predict([[1e3, -1e3]])).all()


class Mean:
    """A regressor of no library's class."""

    def fit(self, X, y):
        self.mean = np.mean(y, axis=0)
        return self

    def predict(self, X):
        return np.tile(self.mean, (len(X), 1))


@pytest.mark.parametrize("given", [
    Linear(), GaussianProcess(), DropoutNet(), NamedEffects(), Ensemble(), Mean(),
    PLSRegression(), TransformedTargetRegressor(), make_pipeline(StandardScaler(), Ridge()),
    make_pipeline(StandardScaler(), GridSearchCV(Ridge(), {"alpha": [1.0]})),
], ids=lambda v: type(v).__name__)  # fmt: skip
def test_regressors_of_any_library_may_learn_a_difference(given):
    check_regressor(given)


class Short(Mean):
    def predict(self, X):
        return np.zeros(3)


class Blank(Mean):
    def predict(self, X):
        return np.full(len(X), np.nan)


def test_effects_need_a_simulator_that_hosts_them_before_anything_is_computed():
    class Plain(Simulator):
        name, dt, state_channels, action_channels, parameters = "plain", 0.1, (), (), {}

        def step(self, states, actions):
            return states

    with pytest.raises(ValueError, match="NamedEffects needs a simulator that hosts effects"):
        check_regressor(NamedEffects(), Plain())


@pytest.mark.parametrize(("given", "says"), [
    (object(), r"object, which has no method fit\(X, y\)"),
    (Short(), r"Short predicts shape \(3,\) for 32 rows"), (Blank(), "Blank predicts nan"),
], ids=lambda v: v if isinstance(v, str) else type(v).__name__)  # fmt: skip
def test_what_cannot_learn_a_plane_is_refused_before_anything_is_computed(given, says):
    with pytest.raises(ValueError, match=says):
        check_regressor(given)


@pytest.mark.parametrize(("given", "says"), [
    (LogisticRegression(), "classifier"), (KMeans(), "clusterer"),
    (IsolationForest(), "outlier detector"), (StandardScaler(), "it has no predict"),
    (make_pipeline(StandardScaler(), LogisticRegression()), "classifier"),
], ids=lambda v: v if isinstance(v, str) else type(v).__name__)  # fmt: skip
def test_what_is_no_regressor_is_refused_before_anything_is_computed(given, says):
    name = type(given).__name__
    with pytest.raises(ValueError, match=rf"estimator is {name}, which is no regressor \({says}\)"):
        check_regressor(given)
