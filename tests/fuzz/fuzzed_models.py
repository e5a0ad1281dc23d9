"""Damaged and forged policies, agents, models and transitions: a ValueError that names the file.

Damaged: bytes were hurt. Forged: the checksum is right, but a value in the header or an array is
another; it must be refused, or be usable and claim little memory.
"""

from __future__ import annotations

import copy
import functools
import importlib.util
import tracemalloc
from pathlib import Path

import gymnasium
import numpy as np
from damage import OTHER, REFUSED, SAME, Defect, damaged, places
from sklearn.linear_model import Ridge

import residual
from policy import DDPG, DDPGConfig, MlpPolicy
from residual.difference import DifferenceModel
from residual.dropout_net import DropoutNet
from residual.gaussian_process import GaussianProcess
from residual.linear import Linear
from residual.trajectories import Transitions
from simgap_files.arrays import read_arrays, write_arrays
from simgap_files.npz import read_npz, write_npz
from sims.pendulum_equation import PendulumEquation

MEGABYTES = 64
LOADERS = {
    "policy": MlpPolicy.load, "agent": DDPG.load, "transitions": Transitions.load,
    "rollout": read_npz,
}  # fmt: skip
NPZ = ("transitions", "rollout")
#: Estimators of other libraries need skops.
FOREIGN = ("ridge",) if importlib.util.find_spec("skops") else ()
FILES = ("policy", "agent", "linear", "network", "process", "difference", "effects", *FOREIGN, *NPZ)
KINDS = (*(f"{kind}, damaged" for kind in FILES), *(f"{kind}, forged" for kind in FILES[:-1]))


def attempt(kind: str, rng: np.random.Generator, folder: Path) -> str:
    """Hurt one file and load it; how it ended.

    Raises:
        Defect: In a way that is not promised.
    """
    what, how = kind.split(", ")
    source = whole(what, folder)
    path = folder / f"{how}-{what}"
    if how == "damaged":
        path.write_bytes(damaged(source.read_bytes(), rng))
    else:
        header, arrays = copy.deepcopy(_content(what, source))
        _forge(header, arrays, rng)
        with np.errstate(all="ignore"):
            write_npz(path, arrays) if what in NPZ else write_arrays(path, header, arrays)
    tracemalloc.start()
    try:
        loaded = load(what, path)
    except ValueError as error:
        if str(path) not in str(error) or "\n" in str(error):
            raise Defect(f"does not name {path}, or is not one line: {error}") from None
        return REFUSED
    finally:
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        if peak > MEGABYTES * 2**20:
            raise Defect(f"claimed {peak / 2**20:.0f} MB")
    if same(_content(what, path), _content(what, source)):
        return SAME
    if how == "damaged":
        raise Defect("other content than was written")
    if what == "policy" and not np.isfinite(loaded.act(np.zeros(loaded.observation_size))).all():
        raise Defect("a policy that does not act")
    return OTHER


def load(what: str, path: Path):
    if what == "effects":
        return residual.load(path, PendulumEquation())
    return LOADERS.get(what, residual.load)(path)


def _content(what: str, path: Path) -> tuple[dict, dict]:
    return ({}, read_npz(path)) if what in NPZ else read_arrays(path)


def same(first: tuple[dict, dict], second: tuple[dict, dict]) -> bool:
    (header, arrays), (other, others) = first, second
    return header == other and arrays.keys() == others.keys() and all(
        np.array_equal(arrays[name], others[name]) for name in arrays
    )  # fmt: skip


@functools.cache
def agent() -> DDPG:
    box = gymnasium.spaces.Box(-1.0, 1.0, (2,))
    made = DDPG(box, box, DDPGConfig(hidden=(5, 4), batch=4, replay=50, warm_up=4))
    rows = np.random.default_rng(0).normal(size=(10, 2))
    made.replay.extend(rows, rows, rows[:, 0], rows, np.zeros(10))
    return made


@functools.cache
def whole(what: str, folder: Path) -> Path:
    """Where a sound file of this kind lies."""
    path = folder / f"{what}.{'npz' if what in NPZ else 'safetensors'}"
    random = np.random.default_rng(0)
    X, y = random.normal(size=(30, 3)), random.normal(size=(30, 2))
    rows = Transitions(X[:, :2], X[:, 2:], X[:, :2] + 0.1 * y, np.zeros(30, np.int64))
    match what:
        case "policy":
            agent().policy.save(path)
        case "agent":
            agent().save(path)
        case "transitions":
            rows.save(path)
        case "rollout":
            write_npz(path, {"states": X, "actions": y, "rewards": y[:, 0]})
        case "ridge":
            residual.save(Ridge().fit(X, y), path)
        case "difference":
            residual.save(DifferenceModel(Linear(), PendulumEquation()).fit(rows), path)
        case "effects":
            actions = random.uniform(-3, 3, (40, 1))
            states = PendulumEquation.true().rollout(np.array([[1.0, 0.0]]), actions[None])[0]
            data = Transitions(states[:-1], actions, states[1:], np.zeros(40, np.int64))
            named = DifferenceModel(residual.NamedEffects(), PendulumEquation())
            residual.save(named.fit(data), path)
        case _:
            made = {
                "linear": Linear(degree=2),
                "network": DropoutNet(hidden=(6, 5), epochs=2, random_state=0),
                "process": GaussianProcess(max_iter=3, random_state=0),
            }[what]
            residual.save(made.fit(X, y), path)
    return path


_ODD = (
    None, -1, 0, 3.5, 1e300, float("nan"), 10**11, 2**63, "x", "os.system", [], {}, [10**9] * 2,
    True, "", [[[]]], {"class_path": "os.system", "init_args": {}},
)  # fmt: skip


def _forge(header: dict, arrays: dict, rng: np.random.Generator) -> None:
    """Another value somewhere in the header, or an array of other shape, type or content."""
    everywhere = places(header)
    chosen = int(rng.integers(len(everywhere) + len(arrays)))
    if chosen < len(everywhere):
        node, key = everywhere[chosen]
        if rng.random() < 0.25 and isinstance(node, dict):
            del node[key]
        else:
            node[key] = copy.deepcopy(_ODD[rng.integers(len(_ODD))])
        return
    name = sorted(arrays)[chosen - len(everywhere)]
    array = arrays[name]
    changes = [
        lambda: array.ravel()[:-1], lambda: array[None], lambda: array.astype(np.int8),
        lambda: array * np.nan, lambda: np.zeros((0, 10**12), array.dtype),
        lambda: np.full_like(array, 10**7 + 1 if array.dtype.itemsize > 2 else 1),
        lambda: -array if array.dtype != bool else ~array, lambda: array.astype(np.float16),
        lambda: np.array(10**11), lambda: array.astype(np.complex64), lambda: array * 1e30,
    ]  # fmt: skip
    with np.errstate(all="ignore"):
        arrays[name] = changes[rng.integers(len(changes))]()
