"""Estimators of other libraries in files: the same predictions, and no code from the file."""

from __future__ import annotations

import numpy as np
import pytest
from sklearn.ensemble import RandomForestRegressor
from sklearn.linear_model import BayesianRidge, LinearRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer, PolynomialFeatures

from residual import DifferenceModel, DropoutNet, Ensemble, NamedEffects, load, save
from residual.trajectories import Transitions
from sims.pendulum import Pendulum

pytest.importorskip("skops")

RAN: list[str] = []


def leave_a_trace(X):
    RAN.append("ran")
    return X


def observed(n=80):
    random = np.random.default_rng(0)
    states, actions = random.uniform([-3, -10], [3, 10], (n, 2)), random.uniform(-3, 3, (n, 1))
    return Transitions(states, actions, Pendulum.true().step(states, actions), np.zeros(n, int))


@pytest.mark.parametrize(
    "estimator",
    [
        make_pipeline(PolynomialFeatures(2), LinearRegression()),
        BayesianRidge(),
        Ensemble(LinearRegression(), n=2, random_state=0),
        Ensemble(DropoutNet(hidden=(8,)), n=2, random_state=0),
    ],
    ids=lambda e: type(e).__name__,
)
def test_it_comes_back_with_the_same_bits(estimator, tmp_path):
    data, path = observed(), tmp_path / "model.safetensors"
    model = DifferenceModel(estimator, Pendulum()).fit(data)
    save(model, path)
    back = load(path, Pendulum())
    found = back.predict(data.states, data.actions)
    assert np.array_equal(found, model.predict(data.states, data.actions))
    save(model.fitted(), path)
    assert type(load(path)) is type(model.fitted())


def test_types_that_are_not_known_to_be_safe_are_named_and_refused(tmp_path):
    data, path = observed(), tmp_path / "model.safetensors"
    model = DifferenceModel(RandomForestRegressor(3, random_state=0), Pendulum()).fit(data)
    save(model, path)
    with pytest.raises(ValueError, match=r"_tree.Tree; .* load it with trusted=\['sklearn") as e:
        load(path, Pendulum())
    assert str(path) in str(e.value) and "\n" not in str(e.value)
    back = load(path, Pendulum(), trusted=["sklearn.tree._tree.Tree"])
    found = back.predict(data.states, data.actions)
    assert np.array_equal(found, model.predict(data.states, data.actions))


def test_no_function_of_the_file_runs_when_it_is_loaded(tmp_path):
    data, path = observed(), tmp_path / "model.safetensors"
    pipeline = make_pipeline(FunctionTransformer(leave_a_trace), LinearRegression())
    save(DifferenceModel(pipeline, Pendulum()).fit(data), path)
    RAN.clear()
    with pytest.raises(ValueError, match="leave_a_trace"):
        load(path, Pendulum())
    assert not RAN


def test_a_damaged_file_is_refused(tmp_path):
    path = tmp_path / "model.safetensors"
    save(DifferenceModel(BayesianRidge(), Pendulum()).fit(observed()), path)
    content = bytearray(path.read_bytes())
    content[-100] ^= 1
    path.write_bytes(bytes(content))
    with pytest.raises(ValueError, match="does not have its checksum"):
        load(path, Pendulum())


def test_an_ensemble_of_named_effects_cannot_be_saved(tmp_path):
    from residual.foreign import dumped

    with pytest.raises(TypeError, match="they hold a simulator"):
        dumped(Ensemble(NamedEffects(Pendulum())))
