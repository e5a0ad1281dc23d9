"""A mass on a spring with a damper, whose records are made by SciPy."""

import numpy as np
from scipy.integrate import solve_ivp

from residual.trajectories import Trajectory
from sims import Channel, EquationOfMotion, Parameter

DT, ROWS = 0.05, 500


class Trolley(EquationOfMotion):
    """A mass on a spring with a damper."""

    dt = DT
    state_channels = (
        Channel("place", "m", "position"),
        Channel("speed", "m/s", "rate", rate_of="place", scale=1.0),
    )
    action_channels = (Channel("push", "N", "input", scale=10.0, low=-20, high=20),)
    parameters = {
        "mass": Parameter(2.0, "kg", "of the trolley", low=0.1),
        "stiffness": Parameter(20.0, "N/m", "of the spring", low=0.0),
        "damping": Parameter(1.0, "N s/m", "of the damper", low=0.0),
    }

    def acceleration(self, q, v, u, force, p):
        pull = p.stiffness * q[:, 0] + p.damping * v[:, 0]
        return ((force[:, 0] + u[:, 0] - pull) / p.mass)[:, None]


def record(seed, stiffness, friction=0.0, damping=lambda place: 1.0, drag=0.0):
    """A record by SciPy; ``stiffness`` of the part of the record that has passed."""
    rng = np.random.default_rng(seed)
    pushes = np.repeat(rng.uniform(-10, 10, ROWS // 20 + 1), 20)[:ROWS]
    state, path = np.zeros(2), [np.zeros(2)]
    for row in range(ROWS - 1):
        spring, push = stiffness(row / ROWS), pushes[row]

        def moves(_, x, spring=spring, push=push):
            dry = friction * np.tanh(x[1] / 0.01)
            braked = damping(x[0]) * x[1] + drag * x[1] * abs(x[1]) + dry
            return [x[1], (push - spring * x[0] - braked) / 2.0]

        state = solve_ivp(moves, (0, DT), state, rtol=1e-8, atol=1e-10).y[:, -1]
        path.append(state)
    seen = np.array(path) + rng.standard_normal((ROWS, 2)) * [1e-3, 5e-3]
    return Trajectory(f"run {seed}", DT * np.arange(ROWS), seen, pushes[:-1, None])
