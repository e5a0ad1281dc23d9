"""One of two sensors is late: it is read earlier, and physics is found as it is."""

import re

import numpy as np
import pytest
from hanging import DT, ROPE, Crane
from scipy.integrate import solve_ivp

from residual.gap import find_gap
from residual.trajectories import Trajectory

FRICTION, LATE = 4.0, 0.15


def crane(seed, late):
    """Fifteen seconds with friction of the trolley, by SciPy; the load is seen late."""
    rng = np.random.default_rng(seed)
    forces = np.repeat(rng.uniform(-20, 20, 20), 15)
    state, path = np.zeros(4), [np.zeros(4)]
    fine = np.linspace(0, DT, 2)
    for u in forces:

        def moves(_, x, u=u):
            pull = (u + 20 * x[2] - FRICTION * np.tanh(x[1] / 1e-2)) / 5
            return [x[1], pull, x[3], (-pull - 9.81 * x[2]) / ROPE]

        state = solve_ivp(moves, (0, DT), state, t_eval=fine, rtol=1e-7, atol=1e-9).y[:, -1]
        path.append(state)
    times = DT * np.arange(len(path))
    seen = np.array(path)
    seen[:, 2] = np.interp(times - late, times, seen[:, 2])
    seen += rng.normal(0, 1e-3, seen.shape)
    seen[:, [1, 3]] = np.nan
    return Trajectory(f"run {seed}", times, seen, forces[:, None])


@pytest.mark.long
@pytest.mark.parametrize("late", [0.0, LATE])
def test_a_late_sensor_is_told_and_nothing_is_made_of_it(late):
    offered = ("coulomb_friction@trolley", "delay")
    found = find_gap(Crane(), [crane(seed, late) for seed in range(3)], effects=offered)
    (sure,) = [v for v in found.verdicts if v.kind == "confirmed"]
    assert sure.label == "coulomb_friction@trolley"
    level = sure.parameters["level"]
    assert level.low <= FRICTION <= level.high
    said = [one.says for one in found.quality if "swing comes about" in one.says]
    assert bool(said) == bool(late)
    if said:
        (seconds,) = re.findall(r"about ([\d.]+) s", said[0])
        assert float(seconds) == pytest.approx(LATE, abs=0.02)


def test_beside_friction_alone_it_is_told_of_two_runs():
    runs = [crane(seed, LATE) for seed in range(2)]
    found = find_gap(Crane(), runs, effects="coulomb_friction@trolley")
    (sure,) = [v for v in found.verdicts if v.kind == "confirmed"]
    level = sure.parameters["level"]
    assert level.low <= FRICTION <= level.high
    (said,) = [one.says for one in found.quality if "swing comes about" in one.says]
    (seconds,) = re.findall(r"about ([\d.]+) s", said)
    assert float(seconds) == pytest.approx(LATE, abs=0.02)
