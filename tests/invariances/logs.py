"""Logs of systems of several kinds, synthetic and measured, to be changed in ways that must not
matter."""

from __future__ import annotations

import dataclasses
import functools
import os
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

import studies
from residual.trajectories import Trajectory
from sims.host import HostSimulator
from sims.pendulum_equation import PendulumEquation
from studies.hidden.data import Truth, integrate
from studies.hidden.dirty.sets import make_set
from studies.real.judge import Judge
from studies.real.rigs import RIGS

DATA = Path(os.environ.get("SIMGAP_DATA", Path(studies.__file__).parents[2] / "shared" / "data"))


@dataclasses.dataclass(frozen=True)
class Log:
    """What find_gap is given: a nominal simulator and runs."""

    simulator: HostSimulator
    runs: tuple[Trajectory, ...]


def pendulum(truth: Truth, seed: int = 5, runs: int = 4, rows: int = 320) -> Log:
    """The pendulum under voltages that are held for 0.2 s, measured every 25 ms."""
    rng = np.random.default_rng(seed)
    made = []
    for run in range(runs):
        volts = np.repeat(rng.uniform(-2.5, 2.5, rows // 8), 8)
        state = np.zeros((5, 1))
        state[0] = np.pi + rng.uniform(-1, 1)
        path = [state[:2, 0]]
        for command in volts:
            state = integrate(truth, state, np.array([command]), 0.025)
            path.append(state[:2, 0])
        seen = np.array(path) + rng.standard_normal((rows + 1, 2)) * [0.005, 0.1]
        made.append(Trajectory(f"run {run}", 0.025 * np.arange(rows + 1.0), seen, volts[:, None]))
    return Log(PendulumEquation(), tuple(made))


def dirty(system: str, hidden: str, size: float, seed: int) -> Log:
    """One set of the dirty world."""
    made = make_set(
        {"system": system, "hidden": hidden, "size": size, "layout": "many", "seed": seed}
    )
    return Log(made.simulator, tuple(made.logs))


def rig(folder: str) -> Log:
    """The fit part of a measured rig, as its config reads it."""
    (found,) = [one for one in RIGS if one.folder == folder]
    with tempfile.TemporaryDirectory() as scratch:
        judge = Judge(found, DATA, Path(scratch))
    return Log(judge.simulator, tuple(judge._fit))


MAKERS: dict[str, Callable[[], Log]] = {
    "heavier pendulum": lambda: pendulum(Truth(mass=0.3)),
    "pendulum with friction": lambda: pendulum(Truth(coulomb_friction=4e-4)),
    "dirty arm": lambda: dirty("arm", "viscous_friction@shoulder", 4.0, 1),
    "dirty oven": lambda: dirty("oven", "delay@power", 4.0, 3),
    "airtrack": lambda: rig("airtrack"),
    "heater": lambda: rig("heater"),
    "phone-drop": lambda: rig("phone-drop"),
    "pendulum-pair": lambda: rig("pendulum-pair"),
    "pendulum-swingup": lambda: rig("pendulum-swingup"),
}
MEASURED = frozenset(one.folder for one in RIGS)


@functools.cache
def log(name: str) -> Log:
    """One of ``MAKERS``."""
    return MAKERS[name]()
