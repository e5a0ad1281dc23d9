"""Saving and loading: round trips, and files that are damaged or hostile."""

from __future__ import annotations

import json
import pickle

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from safetensors.numpy import save_file

from residual.difference import DifferenceModel
from residual.dropout_net import DropoutNet
from residual.gaussian_process import GaussianProcess
from residual.linear import Linear
from residual.persistence import load, save
from residual.trajectories import Transitions
from simgap_files.arrays import read_arrays, write_arrays
from sims.pendulum import Pendulum

OURS = [
    Linear(degree=2),
    Linear(features="raw", scales=np.array([1.0, 2.0, 3.0])),
    GaussianProcess(max_iter=5, random_state=0),
    GaussianProcess(max_iter=5, max_points=40, inducing=20, kernel="matern", random_state=0),
    DropoutNet(hidden=(16, 8), epochs=3, random_state=0),
    DropoutNet(hidden=[16], epochs=3, dropout=0.0, fine_tuning=0.0),
]


def data(n=60, seed=0):
    random = np.random.default_rng(seed)
    X = random.uniform(-2, 2, (n, 3))
    return X, np.stack([np.sin(X[:, 0]), X[:, 1] * X[:, 2]], axis=1)


@pytest.mark.parametrize("estimator", OURS, ids=lambda e: type(e).__name__)
@pytest.mark.parametrize("flat", [False, True])
def test_an_estimator_comes_back_with_the_same_bits(estimator, flat, tmp_path):
    X, y = data()
    estimator.fit(X, y[:, 0] if flat else y)
    save(estimator, tmp_path / "model.safetensors")
    back = load(tmp_path / "model.safetensors")
    assert type(back) is type(estimator)
    probe = data(seed=1)[0]
    for ours, theirs in zip(
        back.predict(probe, return_std=True), estimator.predict(probe, return_std=True), strict=True
    ):
        assert np.array_equal(ours, theirs)
    params = {k: v for k, v in estimator.get_params().items() if np.ndim(v) == 0}
    assert params.items() <= back.get_params().items()
    assert [p.name for p in tmp_path.iterdir()] == ["model.safetensors"]
    back.fit(X, y)


def transitions(n=60):
    random = np.random.default_rng(0)
    states = random.uniform([-4, -10], [4, 10], (n, 2))
    actions = random.uniform(-3, 3, (n, 1))
    after = Pendulum.true().step(states, actions)
    return Transitions(states, actions, after, np.zeros(n, int))


@pytest.mark.parametrize("estimator", [OURS[0], OURS[2], OURS[4]], ids=lambda e: type(e).__name__)
def test_a_difference_model_comes_back(estimator, tmp_path):
    rows = transitions()
    model = DifferenceModel(estimator, Pendulum()).fit(rows)
    save(model, tmp_path / "model")
    back = load(tmp_path / "model")
    expected = model.predict(rows.states, rows.actions, return_std=True)
    assert np.array_equal(back.predict(rows.states, rows.actions, return_std=True), expected)
    assert back.dt == model.dt and back.state_channels == model.state_channels
    with pytest.raises(ValueError, match="has no simulator"):
        back.fit(rows)
    again = load(tmp_path / "model", Pendulum()).fit(rows)
    assert np.allclose(again.predict(rows.states, rows.actions), expected[0], atol=1.0)
    with pytest.raises(ValueError, match=r"period of 0.05 s, the simulator has 0.02 s"):
        load(tmp_path / "model", Pendulum(dt=0.02))


def test_what_no_file_can_hold_is_refused(tmp_path):
    odd = GaussianProcess(max_iter=3, random_state=np.random.RandomState(0))
    with pytest.raises(TypeError, match="random_state is a RandomState"):
        save(odd.fit(*data()), tmp_path / "model")
    assert not list(tmp_path.iterdir())


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"there is no file .*nowhere"):
        load(tmp_path / "nowhere")


class Bomb:
    def __reduce__(self):
        return (pytest.fail, ("the file ran code",))


def test_a_pickle_is_refused_and_not_run(tmp_path):
    for name, content in {"pickle": pickle.dumps(Bomb()), "empty": b"", "text": b"hello"}.items():
        (tmp_path / name).write_bytes(content)
        with pytest.raises(ValueError, match=f"{name} is damaged or no safetensors file"):
            load(tmp_path / name)
    np.save(tmp_path / "object.npy", np.array([Bomb()], object), allow_pickle=True)
    with pytest.raises(ValueError, match=r"object.npy is damaged"):
        load(tmp_path / "object.npy")


def edited(path, change, tensors=None):
    """Rewrite a saved file with another header or other arrays, and the checksum of those."""
    header, arrays = read_arrays(path)
    change(header)
    if tensors:
        tensors(arrays)
    write_arrays(path, header, arrays)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda h: h.update({"class": "os.system"}), "holds a 'os.system'; only DropoutNet"),
        (lambda h: h.update({"class": "DropoutNet"}), "DropoutNet of format 1, this release reads"),
        (lambda h: h.update({"class": "DropoutNet", "class_format": 2}), "damaged"),
        (lambda h: h["params"].update(surprise=1), "damaged"),
        (lambda h: h["params"].update(degree=7), "damaged"),
        (lambda h: h["params"].update(angles=["__import__('os')"]), "damaged"),
        (lambda h: h.pop("params"), "damaged"),
        (lambda h: h.update(difference={"dt": "x"}), "damaged"),
    ],
)
def test_an_edited_header_is_refused(change, message, tmp_path):
    path = tmp_path / "model"
    save(Linear(degree=2).fit(*data()), path)
    if "degree" in str(change.__code__.co_consts):
        # The degree in use is among the arrays; another one does not fit the weights.
        edited(path, lambda h: None, lambda a: a.update(degree_=np.array(3)))
    else:
        edited(path, change)
    with pytest.raises(ValueError, match=message) as error:
        load(path)
    assert str(path) in str(error.value)


@pytest.mark.parametrize(
    "change",
    [
        lambda arrays: arrays.pop("coef_"),
        lambda arrays: arrays.update(coef_=arrays["coef_"][:-1]),
        lambda arrays: arrays.update(coef_=np.full_like(arrays["coef_"], np.nan)),
        lambda arrays: arrays.update(n_features_in_=np.array(7)),
        lambda arrays: arrays.update(degree_=np.array(10**6)),
    ],
)
def test_edited_arrays_are_refused(change, tmp_path):
    path = tmp_path / "model"
    save(Linear(degree=2).fit(*data()), path)
    edited(path, lambda header: None, change)
    with pytest.raises(ValueError, match="damaged"):
        load(path)


def test_a_file_of_a_later_release_is_refused(tmp_path):
    header = json.dumps({"version": 99})
    save_file({"x": np.zeros(1)}, tmp_path / "later", metadata={"simgap": header})
    with pytest.raises(ValueError, match="format version 99"):
        load(tmp_path / "later")


def test_another_safetensors_file_is_refused(tmp_path):
    save_file({"weights": np.zeros(3)}, tmp_path / "other")
    with pytest.raises(ValueError, match="not of this project"):
        load(tmp_path / "other")


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(cut=st.floats(0, 0.999), flip=st.integers(0, 10**6), how=st.sampled_from(["cut", "flip"]))
def test_a_damaged_file_never_raises_anything_but_a_value_error(cut, flip, how, tmp_path):
    path = tmp_path / "model"
    save(Linear(features="raw").fit(*data()), path)
    content = bytearray(path.read_bytes())
    if how == "cut":
        content = content[: int(cut * len(content))]
    else:
        content[flip % len(content)] ^= 1 << flip % 8
    path.write_bytes(bytes(content))
    try:
        model = load(path)
    except ValueError as error:
        assert str(path) in str(error)
    else:
        # White space of the header, say: the checksum is of what the file holds.
        assert how == "flip" and np.isfinite(model.predict(np.zeros((1, 3)))).all()


def test_a_simulator_with_other_parameters_is_refused(tmp_path):
    model = DifferenceModel(Linear(), Pendulum()).fit(transitions())
    save(model, tmp_path / "model.safetensors")
    assert load(tmp_path / "model.safetensors", Pendulum()).simulator is not None
    heavier = Pendulum().with_parameters(mass=0.1)
    with pytest.raises(ValueError, match=r"fitted beside mass .* and the simulator has 0\.1"):
        load(tmp_path / "model.safetensors", heavier)
    header, arrays = read_arrays(tmp_path / "model.safetensors")
    del header["difference"]["parameters"]  # as an earlier version wrote it
    write_arrays(tmp_path / "old.safetensors", header, arrays)
    load(tmp_path / "old.safetensors", heavier)
