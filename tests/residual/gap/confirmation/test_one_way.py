"""Dry friction and a load where motion goes one way only."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter

DT, MASS, FRICTION = 0.02, 10.0, 6.0


class Cart(EquationOfMotion):
    """A cart that is pushed, on wheels without friction."""

    dt = DT
    state_channels = (
        Channel("x", "m", "position"),
        Channel("v", "m/s", "rate", rate_of="x", scale=1.0),
    )
    action_channels = (Channel("force", "N", "input", scale=10.0),)

    def __init__(self, **options):
        self.parameters = {"mass": Parameter(MASS, "kg", "of the cart", low=1.0)}
        super().__init__(**options)

    def acceleration(self, q, v, u, force, p):
        return ((u[:, 0] + force[:, 0]) / p.mass)[:, None]


def pushed(forces, load=0.0):
    """Each force for a second; what sticks stays until more than its friction pulls."""

    def rates(_, state, force):
        pull = force - load
        if abs(state[1]) < 1e-3 and abs(pull) <= FRICTION:
            return [0.0, -50.0 * state[1]]
        return [state[1], (pull - FRICTION * np.tanh(state[1] / 1e-3)) / MASS]

    states, commands = [np.zeros(2)], np.repeat(forces, 50)
    for force in commands:
        done = solve_ivp(rates, (0, DT), states[-1], args=(force,), max_step=DT / 8, rtol=1e-6)
        states.append(done.y[:, -1])
    seen = np.array(states) + np.random.default_rng(0).normal(0, [2e-4, 2e-3], (len(states), 2))
    return Trajectory("cart", DT * np.arange(len(seen)), seen, commands[:, None])


def friction_in(run):
    offered = ["coulomb_friction", "constant_load", "mass"]
    found = find_gap(Cart(), [run], effects=offered, parameter_tolerance=0.0)
    (named,) = (v for v in found.verdicts if v.effect == "coulomb_friction")
    return named


@pytest.mark.parametrize("load", [0.0, 4.0])
def test_with_stops_and_no_way_back_a_part_of_it_may_be_a_load(load):
    rng = np.random.default_rng(1)
    forces = load + np.tile([10.0, 0.5], 8) + np.repeat(rng.uniform(-1, 1, 8), 2)
    named = friction_in(pushed(forces, load))
    assert (named.kind, named.doubts) == ("ambiguous", ("one_way",))
    assert named.parameters["level"].value == pytest.approx(FRICTION + load, rel=0.05)


def test_where_motion_turns_back_it_is_certain():
    rng = np.random.default_rng(1)
    named = friction_in(pushed(rng.choice([-1, 1], 16) * rng.uniform(4, 15, 16)))
    assert named.kind == "confirmed"
    assert named.parameters["level"].value == pytest.approx(FRICTION, rel=0.01)
