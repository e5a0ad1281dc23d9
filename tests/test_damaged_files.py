"""Every file of ours that is damaged or forged: a ValueError that names it, and little memory."""

from __future__ import annotations

import copy
import functools
import tracemalloc

import gymnasium
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from safetensors.numpy import load_file, save_file

import residual
from policy import DDPG, DDPGConfig, MlpPolicy, load_policy
from residual.difference import DifferenceModel
from residual.dropout_net import DropoutNet
from residual.gaussian_process import GaussianProcess
from residual.linear import Linear
from residual.trajectories import Transitions
from simgap_arrays import read_arrays, write_arrays
from sims.pendulum_equation import PendulumEquation

MEGABYTES = 64
LOADERS = {"policy": MlpPolicy.load, "agent": DDPG.load}
KINDS = ["policy", "agent", "linear", "network", "process", "difference"]
QUICK = 200
LONG = 3000


@functools.cache
def agent():
    box = gymnasium.spaces.Box(-1.0, 1.0, (2,))
    made = DDPG(box, box, DDPGConfig(hidden=(5, 4), batch=4, replay=50, warm_up=4))
    rows = np.random.default_rng(0).normal(size=(10, 2))
    made.replay.extend(rows, rows, rows[:, 0], rows, np.zeros(10))
    return made


@functools.cache
def whole(kind, folder):
    """Where a sound file of this kind lies."""
    path = folder / f"{kind}.safetensors"
    random = np.random.default_rng(0)
    X, y = random.normal(size=(30, 3)), random.normal(size=(30, 2))
    estimators = {
        "linear": Linear(degree=2),
        "network": DropoutNet(hidden=(6, 5), epochs=2, random_state=0),
        "process": GaussianProcess(max_iter=3, random_state=0),
    }
    if kind == "policy":
        agent().policy.save(path)
    elif kind == "agent":
        agent().save(path)
    elif kind == "difference":
        rows = Transitions(X[:, :2], X[:, 2:], X[:, :2] + 0.1 * y, np.zeros(30, int))
        residual.save(DifferenceModel(Linear(), PendulumEquation()).fit(rows), path)
    else:
        residual.save(estimators[kind].fit(X, y), path)
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("files")


def load(kind, path):
    return LOADERS.get(kind, residual.load)(path)


def same(first, second):
    (header, arrays), (other, others) = first, second
    return header == other and arrays.keys() == others.keys() and all(
        np.array_equal(arrays[name], others[name]) for name in arrays
    )  # fmt: skip


spots = st.one_of(st.integers(0, 2000), st.integers(0, 10**7))  # headers are where it hurts
mutations = st.lists(
    st.tuples(
        st.sampled_from(["flip", "set", "cut", "insert", "zeros", "repeat"]),
        spots,
        st.binary(min_size=1, max_size=8),
    ),
    min_size=1,
    max_size=3,
)


def mutated(content, changes):
    content = bytearray(content)
    for how, spot, some in changes:
        at = spot % max(len(content), 1)
        if how == "cut" or not content:
            del content[at:]
        elif how == "flip":
            content[at] ^= 1 << some[0] % 8
        elif how == "set":
            content[at : at + len(some)] = some
        elif how == "insert":
            content[at:at] = some
        elif how == "zeros":
            content[at : at + 64] = bytes(len(content[at : at + 64]))
        else:
            content[at:at] = content[at : at + 64]
    return bytes(content)


def check_damaged(kind, folder, changes):
    source, path = whole(kind, folder), folder / f"damaged-{kind}"
    path.write_bytes(mutated(source.read_bytes(), changes))
    try:
        load(kind, path)
    except ValueError as error:
        assert str(path) in str(error)
    else:
        assert same(read_arrays(path), read_arrays(source))


ODD = [None, -1, 0, 3.5, 1e300, float("nan"), 10**11, 2**63, "x", "os.system", [], {}, [10**9] * 2]


def forged(header, arrays, pick, value, number):
    """Another value somewhere in the header, or an array of other shape, type or content."""
    places = []

    def walk(node):
        for key in node if isinstance(node, dict) else range(len(node)):
            places.append((node, key))
            if isinstance(node[key], dict | list):
                walk(node[key])

    walk(header)
    chosen = pick % (len(places) + len(arrays))
    if chosen < len(places):
        node, key = places[chosen]
        if number % 4 == 0 and isinstance(node, dict):
            del node[key]
        else:
            node[key] = copy.deepcopy(value)
        return
    name = sorted(arrays)[chosen - len(places)]
    array = arrays[name]
    changes = [
        lambda: array.ravel()[:-1], lambda: array[None], lambda: array.astype(np.int8),
        lambda: array * np.nan, lambda: np.zeros((0, 10**12), array.dtype),
        lambda: np.full_like(array, 10**7 + 1 if array.dtype.itemsize > 2 else 1),
        lambda: -array if array.dtype != bool else ~array, lambda: array.astype(np.float16),
        lambda: np.array(10**11), lambda: array.astype(np.complex64),
    ]  # fmt: skip
    with np.errstate(all="ignore"):
        arrays[name] = changes[number % len(changes)]()


def check_forged(kind, folder, changes):
    header, arrays = copy.deepcopy(read_arrays(whole(kind, folder)))
    for pick, value, number in changes:
        forged(header, arrays, pick, value, number)
    path = folder / f"forged-{kind}"
    write_arrays(path, header, arrays)
    tracemalloc.start()
    try:
        loaded = load(kind, path)
    except ValueError as error:
        assert str(path) in str(error)
    else:
        # Other numbers than those written, but numbers that can be used.
        if kind == "policy":
            assert np.isfinite(loaded.act(np.zeros(loaded.observation_size))).all()
    finally:
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert peak < MEGABYTES * 2**20


forgeries = st.lists(
    st.tuples(st.integers(0, 10**6), st.sampled_from(ODD), st.integers(0, 10**6)),
    min_size=1,
    max_size=1,
)
careful = {"deadline": None, "suppress_health_check": list(HealthCheck)}


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=QUICK, **careful)
@given(changes=mutations)
def test_a_damaged_file_is_refused(kind, folder, changes):
    check_damaged(kind, folder, changes)


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=QUICK, **careful)
@given(changes=forgeries)
def test_a_forged_file_is_refused_or_usable(kind, folder, changes):
    check_forged(kind, folder, changes)


@pytest.mark.long
@pytest.mark.parametrize("check", [check_damaged, check_forged])
@pytest.mark.parametrize("kind", KINDS)
def test_thousands_of_them(check, kind, folder):
    drawn = mutations if check is check_damaged else forgeries

    @settings(max_examples=LONG, **careful)
    @given(changes=drawn)
    def run(changes):
        check(kind, folder, changes)

    run()


@pytest.mark.parametrize("kind", KINDS)
def test_a_file_of_the_first_version_still_loads(kind, folder, tmp_path):
    import json

    header, arrays = read_arrays(whole(kind, folder))
    del header["version"]
    save_file(arrays, tmp_path / "old", metadata={"simgap": json.dumps(header)})
    load(kind, tmp_path / "old")
    path = tmp_path / "new"
    save_file(arrays, path, metadata={"simgap": json.dumps({**header, "version": 2})})
    with pytest.raises(ValueError, match="checksum is missing"):
        load(kind, path)


def test_a_header_that_asks_for_134_gigabytes(tmp_path, folder):
    header, arrays = copy.deepcopy(read_arrays(whole("agent", folder)))
    header["config"]["replay"] = 4 * 10**9
    write_arrays(tmp_path / "agent", header, arrays)
    with pytest.raises(ValueError, match=r"agent is damaged.*replay is 4000000000, expected"):
        DDPG.load(tmp_path / "agent")


def test_a_damaged_policy_is_not_called_an_agent(tmp_path, folder):
    content = whole("policy", folder).read_bytes()
    (tmp_path / "cut").write_bytes(content[:-4])
    with pytest.raises(ValueError, match=r"cut is damaged"):
        load_policy(tmp_path / "cut")
    arrays = load_file(whole("policy", folder))
    assert np.array_equal(arrays["low"], agent().policy.low)


def test_a_process_without_a_factor_is_refused_and_not_waited_for(tmp_path, folder):
    header, arrays = copy.deepcopy(read_arrays(whole("process", folder)))
    arrays["outputscale_"] *= -1
    write_arrays(tmp_path / "process", header, arrays)
    with pytest.raises(ValueError, match=r"process is damaged.*have to be positive"):
        residual.load(tmp_path / "process")
