"""A spring between two carts, of which the simulator moves one alone: a gap far from its path."""

import numpy as np
from held import path

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import EquationOfMotion
from sims.simulator import Channel

MASSES, RUBS, STIFFNESS, DT = (1.2, 0.8), (0.8, 0.6), 30.0, 0.02


class Carts(EquationOfMotion):
    """Two carts that nothing joins: no input reaches the second."""

    dt = DT
    state_channels = (
        Channel("x1", "m", "position", scale=0.3),
        Channel("v1", "m/s", "rate", rate_of="x1", scale=0.5),
        Channel("x2", "m", "position", scale=0.3),
        Channel("v2", "m/s", "rate", rate_of="x2", scale=0.5),
    )
    action_channels = (Channel("push", "N", "input", low=-10.0, high=10.0, scale=3.0),)

    def acceleration(self, q, v, u, force, p):
        pull = force - np.array(RUBS) * v
        pull[:, :1] += u
        return pull / np.array(MASSES)


def log(rng):
    pushes = np.repeat(rng.uniform(-3, 3, 30).round(1), 16)

    def rates(_, x, u):
        pull = -STIFFNESS * (x[0] - x[2])
        own = [u + pull - RUBS[0] * x[1], -pull - RUBS[1] * x[3]]
        return [x[1], own[0] / MASSES[0], x[3], own[1] / MASSES[1]]

    states = path(rates, [0.0, 0.0, 0.05, 0.0], tuple(pushes), DT)
    seen = states + np.array([6e-4, np.nan] * 2) * rng.standard_normal(states.shape)
    return Trajectory("carts", DT * np.arange(len(seen)), seen, pushes[:, None])


def test_a_spring_between_two_carts_is_found_far_from_the_nominal_path():
    rng = np.random.default_rng(77)
    found = find_gap(Carts(), [log(rng) for _ in range(2)])
    sure = {one.label: one for one in found.verdicts if one.kind == "confirmed"}
    assert set(sure) == {"coupling_spring@x1 and x2"}
    assert sure["coupling_spring@x1 and x2"].parameters["stiffness"].low < STIFFNESS
    assert sure["coupling_spring@x1 and x2"].parameters["stiffness"].high > STIFFNESS
