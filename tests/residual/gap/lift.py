"""Trips of a lift with a load of their own each, and friction of its guides."""

import functools
from typing import ClassVar

import numpy as np
from scipy.integrate import solve_ivp

from residual.trajectories import Trajectory
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter

OFFERED = ["cabin", "weight", "dead_zone"]
#: In kg, by trip.
LOADS = (0.0, 300.0, 520.0, 140.0)
FRICTION = 350.0


class Lift(EquationOfMotion):
    """A cabin without load, and its counterweight."""

    dt = 0.05
    state_channels = (
        Channel("height", "m", "position", scale=10.0),
        Channel("climb", "m/s", "rate", rate_of="height", scale=1.0),
    )
    action_channels = (Channel("force", "N", "input", scale=3000.0),)
    parameters: ClassVar = {
        "cabin": Parameter(900.0, "kg", "of the cabin", low=1.0),
        "weight": Parameter(1150.0, "kg", "of the counterweight", low=1.0),
    }

    def acceleration(self, q, v, u, force, p):
        pull = u[:, 0] - 9.81 * (p.cabin - p.weight) - 120.0 * v[:, 0] + force[:, 0]
        return (pull / (p.cabin + p.weight + 600.0))[:, None]


def trip(load, seed):
    """Two stops and a part of a third, held by a controller of speed; integrated by SciPy."""
    rng = np.random.default_rng(seed)
    stops = rng.permutation([0.0, 4.0, 8.0, 14.0])
    mass, state, heights, forces = 2650.0 + load, np.array([stops[0], 0.0]), [], []
    for k in range(500):
        off = stops[min(k // 225, 3)] - state[0]
        speed = np.sign(off) * min(1.6, abs(off))
        force = -9.81 * 250.0 + 9.81 * 300.0 + 6000.0 * (speed - state[1])
        heights.append(state[0] + rng.normal(0, 1e-3))
        forces.append(force)

        def slope(_, x, force=force):
            rubs = FRICTION * np.tanh(x[1] / 1e-3)
            return [x[1], (force - 9.81 * (load - 250.0) - 120.0 * x[1] - rubs) / mass]

        solved = solve_ivp(slope, (0, 0.05), state, method="LSODA", rtol=1e-7, atol=1e-8)
        state = solved.y[:, -1]
    states = np.stack([heights, np.full(500, np.nan)], axis=1)
    actions = np.array(forces[:-1])[:, None]
    return Trajectory(f"trip {seed}", 0.05 * np.arange(500.0), states, actions)


@functools.cache
def trips():
    """A trip with each load."""
    return [trip(load, 1 + i) for i, load in enumerate(LOADS)]
