"""Inertia that moves with one joint alone: against mass matrices by an independent integrator."""

from typing import ClassVar

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sims.checks import check_simulator
from sims.effects import AddedInertia, CoulombFriction, FlexiblePart, exact_aliases, library
from sims.equations import EquationOfMotion
from sims.pendulum_equation import PendulumEquation
from sims.simulator import Channel, Joint, Parameter

JOINTS = ("shoulder", "elbow")


def matrix(angle):
    """Mass matrix of two links in a horizontal plane."""
    bend = 0.06 * np.cos(angle)
    return np.array([[0.3 + 2 * bend, 0.045 + bend], [0.045 + bend, 0.045]])


def bias(q, v):
    swing = 0.06 * np.sin(q[1])
    return np.array([swing * v[1] * (2 * v[0] + v[1]), -swing * v[0] ** 2])


class Plane(EquationOfMotion):
    dt = 0.01
    substeps = 5
    state_channels = tuple(
        channel
        for name in JOINTS
        for channel in (
            Channel(name, "rad", "position", scale=1.0),
            Channel(f"{name} rate", "rad/s", "rate", rate_of=name, scale=3.0),
        )
    )
    action_channels = tuple(Channel(f"{n} torque", "N m", "input", scale=2.0) for n in JOINTS)
    parameters: ClassVar = {"base": Parameter(0.0, "kg m^2", "of the first motor", scale=0.1)}

    def acceleration(self, q, v, u, force, p):
        bend, swing = 0.06 * np.cos(q[:, 1]), 0.06 * np.sin(q[:, 1])
        a, b, d = 0.3 + 2 * bend + p.base, 0.045 + bend, 0.045
        first = u[:, 0] + force[:, 0] + swing * v[:, 1] * (2 * v[:, 0] + v[:, 1])
        second = u[:, 1] + force[:, 1] - swing * v[:, 0] ** 2
        both = np.stack([d * first - b * second, a * second - b * first], axis=1)
        return both / (a * d - b * b)[:, None]


@pytest.mark.parametrize("added", [(0.1, 0.0), (0.0, 0.03), (0.2, 0.05)])
def test_it_is_added_to_the_diagonal_of_the_mass_matrix(added):
    torque = np.array([0.8, -0.3])

    def rates(t, x):
        forces = torque + bias(x[:2], x[2:])
        return [*x[2:], *np.linalg.solve(matrix(x[1]) + np.diag(added), forces)]

    times = 0.01 * np.arange(101)
    truth = solve_ivp(rates, (0, 1), [0.3, 1.0, 0.5, -1.0], t_eval=times, rtol=1e-10, atol=1e-12).y
    arm = Plane(effects=[AddedInertia(n, i) for n, i in zip(JOINTS, added, strict=True) if i])
    path = arm.rollout([0.3, 0.5, 1.0, -1.0], np.tile(torque, (100, 1)))
    assert path[:, [0, 2, 1, 3]] == pytest.approx(truth.T, abs=1e-6)
    alone = Plane().rollout([0.3, 0.5, 1.0, -1.0], np.tile(torque, (100, 1)))
    assert np.abs(alone - path).max() > 0.01


def test_rows_have_their_own_and_none_changes_no_bit():
    plain, rng = Plane(), np.random.default_rng(0)
    states, actions = rng.normal(0, 1, (4, 4)), rng.uniform(-2, 2, (4, 2))
    inertia = np.array([0.0, 0.1, 1.0, 9.0])
    beside = [CoulombFriction("shoulder", 0.1), FlexiblePart("elbow", 0.2, 4.0)]
    effects = [*beside, AddedInertia("elbow", inertia)]
    host = plain.with_effects(effects)
    full = host.augment(states)
    together = host.step(full, actions)
    for i in range(4):
        own = [*beside, *([AddedInertia("elbow", float(inertia[i]))] if i else [])]
        assert np.array_equal(plain.with_effects(own).step(full[[i]], actions[[i]])[0], together[i])
    assert "failed" not in repr(check_simulator(plain.with_effects([AddedInertia("elbow", 0.1)])))


def test_friction_holds_a_joint_with_its_own_inertia_and_moves_the_other_by_it():
    # Held, the shoulder is a wall: the elbow feels its own inertia alone.
    effects = [CoulombFriction("shoulder", 5.0), AddedInertia("elbow", 0.015)]
    arm = Plane(effects=effects)
    path = arm.rollout(np.zeros(4), np.tile([0.0, 0.03], (20, 1)))
    assert (path[:, :2] == 0.0).all()
    assert path[-1, 3] == pytest.approx(0.03 / 0.06 * 0.2, rel=1e-9)


def test_it_is_offered_where_joints_move_each_other_and_not_beside_a_parameter_for_it():
    offered = {str(e): e for e in library(Plane()) if isinstance(e, AddedInertia)}
    assert set(offered) == {"added_inertia@shoulder", "added_inertia@elbow"}
    quantity = offered["added_inertia@elbow"].quantities(Plane())["inertia"]
    assert quantity.unit == "kg m^2" and 0.01 < quantity.scale < 0.05
    assert not any(isinstance(e, AddedInertia) for e in library(PendulumEquation()))
    twins = [set(one.effects) for one in exact_aliases(Plane()) if not one.combination]
    assert {"base", "added_inertia@shoulder"} in twins
    with pytest.raises(ValueError, match="moves another one, and 'pivot' is none"):
        PendulumEquation(effects=[AddedInertia("pivot", 0.1)])


class Screws(Plane):
    """The same with forces in a unit of their own."""

    joints = tuple(Joint(name, name, f"{name} rate", "N/bar") for name in JOINTS)


def test_its_unit_is_that_of_force_over_acceleration():
    quantity = AddedInertia("elbow").quantities(Screws())["inertia"]
    assert quantity.unit == "N s^2/(bar rad)"
