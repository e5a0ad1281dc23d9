"""A ball that a magnet draws the more the nearer it is, held by a controller."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter

MASS, FORCE, AWAY, DT = 0.0505, 1.39, 35.0, 0.004


class Ball(EquationOfMotion):
    """Under a magnet, about its working point, as if that drew alike everywhere."""

    dt = DT
    state_channels = (
        Channel("gap", "m", "position", scale=0.001),
        Channel("speed", "m/s", "rate", rate_of="gap", scale=0.03),
    )
    action_channels = (Channel("current", "A", "input", scale=0.2),)

    def __init__(self):
        self.parameters = {
            "mass": Parameter(0.050, "kg", "of the ball", low=0.001),
            "force": Parameter(1.40, "N/A", "of the magnet", low=0.01),
        }
        super().__init__()

    def acceleration(self, q, v, u, force, p):
        return ((force[:, 0] - p.force * u[:, 0]) / p.mass)[:, None]


def held(seed, n=1500):
    """Goals change now and then; the controller holds the ball there."""
    rng = np.random.default_rng(seed)
    goals = np.repeat(rng.uniform(-1e-3, 1e-3, n // 50), 50)
    x, states, currents = np.zeros(2), [], []
    for goal in goals:
        seen = x + rng.normal(0, (2e-6, 1e-4))
        current = 75.0 * (seen[0] - goal) + 1.8 * seen[1]
        states.append(seen)
        currents.append(current)
        x = solve_ivp(
            lambda _, x, u=current: [x[1], (AWAY * x[0] - FORCE * u) / MASS],
            (0, DT), x, rtol=1e-8, atol=1e-12,
        ).y[:, -1]  # fmt: skip
    return Trajectory(
        f"run {seed}", DT * np.arange(n), np.array(states), np.array(currents)[:-1, None]
    )


@pytest.mark.long
def test_it_is_no_dead_zone():
    found = find_gap(Ball(), [held(seed) for seed in range(2)])
    sure = {v.label: v for v in found.verdicts if v.kind == "confirmed"}
    assert set(sure) <= {"negative_stiffness@gap", "force_curve@gap", "mass", "force"}
    (away,) = [e for e in found.effects if e.name == "negative_stiffness"]
    assert away.stiffness == pytest.approx(AWAY, rel=0.1)
