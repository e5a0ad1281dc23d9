"""Friction in proportion to what the drive pushes: against closed forms and another integrator."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sims.checks import check_simulator
from sims.effects import CoulombFriction, LoadDependentFriction
from sims.effects.library import further_in
from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.pendulum import Pendulum
from sims.pendulum_equation import PendulumEquation
from sims.simulator import Channel, Joint, Parameter

SHARE, MASS, G = 0.2, 2.0, 9.81


class Hoist(EquationOfMotion):
    """A mass on a lead screw, upright."""

    dt = 0.05
    state_channels = (
        Channel("height", "m", "position", scale=1.0),
        Channel("speed", "m/s", "rate", rate_of="height", scale=1.0),
    )
    action_channels = (Channel("force", "N", "input", scale=20.0),)
    parameters: ClassVar = {"mass": Parameter(MASS, "kg", "what is lifted", low=0.01)}

    def acceleration(self, q, v, u, force, p):
        return (u + force) / np.reshape(p.mass, (-1, 1)) - G


class Arm(EquationOfMotion):
    """Two links in the plane; the inertia couples what drives them."""

    dt = 0.02
    state_channels = tuple(
        Channel(name, unit, kind, rate_of=of, scale=2.0)
        for name, unit, kind, of in (
            ("one", "rad", "position", None), ("two", "rad", "position", None),
            ("one rate", "rad/s", "rate", "one"), ("two rate", "rad/s", "rate", "two"),
        )
    )  # fmt: skip
    action_channels = tuple(Channel(f"torque {i}", "N m", "input", scale=5.0) for i in (1, 2))

    def acceleration(self, q, v, u, force, p):
        c = np.cos(q[:, 1])
        a, b, d = 3 + c, 1 + 0.5 * c, 1.0
        one, two = (u + force).T
        return (
            np.stack([(d * one - b * two), (a * two - b * one)], axis=1) / (a * d - b * b)[:, None]
        )


class Motor(FirstOrderSystem):
    """The speed of a geared motor."""

    dt = 0.01
    state_channels = (Channel("speed", "rad/s", "rate", scale=50.0),)
    action_channels = (Channel("voltage", "V", "input", scale=12.0),)

    def derivative(self, x, u, p):
        return (8.0 * u - x) / 0.25


def test_a_screw_lifts_with_less_and_lets_down_slower():
    hoist, push = Hoist(effects=[LoadDependentFriction("height", SHARE)]), MASS * G
    for speed, force in ((1.0, push), (-1.0, push), (1.0, 2 * push), (-1.0, 0.5 * push)):
        after = hoist.step([[0.0, speed]], [[force]])[0, 1]
        own = (force - np.sign(speed) * SHARE * force) / MASS - G
        assert after == pytest.approx(speed + 0.05 * own, abs=1e-12)


def test_at_rest_it_holds_up_to_its_share_of_the_push_and_no_more():
    hoist, rest = Hoist(effects=[LoadDependentFriction("height", SHARE)]), np.zeros((1, 2))
    held = [f for f in np.linspace(0, 40, 401) if (hoist.step(rest, [[f]]) == rest).all()]
    low, high = MASS * G / (1 + SHARE), MASS * G / (1 - SHARE)
    assert low <= held[0] < low + 0.1 and high - 0.1 < held[-1] <= high
    both = Hoist(effects=[LoadDependentFriction("height", SHARE), CoulombFriction("height", 3.0)])
    held = [f for f in np.linspace(0, 40, 401) if (both.step(rest, [[f]]) == rest).all()]
    assert held[0] == pytest.approx((MASS * G - 3.0) / (1 + SHARE), abs=0.1)


def test_two_joints_against_another_integrator():
    arm, rng = Arm(), np.random.default_rng(0)
    inputs = np.repeat(rng.uniform(-1, 1, (15, 2)) * [15, 5], 8, axis=0)
    x = np.array([0.0, 0.0, 1.0, 0.0])
    path = arm.with_effects([LoadDependentFriction("one", SHARE)]).rollout(x, inputs)

    def rates(_, x, u):  # softened, since it does not stop
        brake = -SHARE * abs(u[0]) * np.tanh(x[2] / 1e-4)
        change = arm.acceleration(x[None, :2], x[None, 2:], u[None], np.array([[brake, 0.0]]), None)
        return [x[2], x[3], *change[0]]

    for u, there in zip(inputs, path[1:], strict=True):
        x = solve_ivp(rates, (0, 0.02), x, "LSODA", args=(u,), rtol=1e-8, atol=1e-9).y[:, -1]
        assert there == pytest.approx(x, abs=5e-5)


def test_it_counts_back_emf_where_the_simulator_tells_its_drive_force():
    motor = PendulumEquation(effects=[LoadDependentFriction("pivot", SHARE)])
    plain, state, u = PendulumEquation(), np.array([[0.0, 5.0]]), np.array([[2.0]])
    drive = plain.drive_forces(state, u)[0, 0]
    assert drive != pytest.approx(plain.drive_forces(0 * state, u)[0, 0], rel=0.1)
    brake = PendulumEquation(effects=[CoulombFriction("pivot", SHARE * abs(drive))])
    h = 1e-4
    push, span = np.full((1, 1, 1), 2.0), np.array([h])
    changes = [one.integrate(state, push, span)[0] - state[0] for one in (motor, brake)]
    assert changes[0] == pytest.approx(changes[1], rel=1e-4)


class Winch(Motor):
    """A motor that tells what its winding pushes, back EMF included."""

    def drive_force(self, x, u, p):
        return (8.0 * u - x) / 0.25


def test_it_counts_back_emf_of_a_speed_that_tells_its_drive_force():
    for speed, volts in ((40.0, 12.0), (90.0, 2.0), (-30.0, 6.0)):
        push = (8.0 * volts - speed) / 0.25
        brake, h = SHARE * abs(push) * np.sign(speed), 1e-4
        winch = Winch(dt=h, effects=[LoadDependentFriction("speed", SHARE)])
        after = winch.step([[speed]], [[volts]])[0, 0]
        assert after == pytest.approx(speed + h * (push - brake), abs=0.02 * h * abs(push))
    assert [str(one) for one in further_in(Winch())][:1] == ["load_dependent_friction@speed"]


class Laden(Motor):
    """The same motor, which holds a weight: a rate of change that no drive makes."""

    def derivative(self, x, u, p):
        return super().derivative(x, u, p) - 30.0


class DrivenByForce(Motor):
    """A speed whose input pushes by itself."""

    action_channels = (Channel("torque", "N m", "input", scale=12.0),)


@pytest.mark.parametrize("system", [Motor, Laden])
def test_of_a_speed_under_voltage_all_is_drive_that_it_makes_beyond_rest(system):
    speeds, volts = np.array([[40.0], [90.0], [-30.0], [5.0]]), np.array([[12.0], [2], [6], [-9]])
    gear = [LoadDependentFriction("speed", SHARE)]
    plain, told = system(dt=1e-3).step(speeds, volts), Winch(dt=1e-3).step(speeds, volts)
    rubs = system(dt=1e-3, effects=gear).step(speeds, volts) - plain
    assert rubs == pytest.approx(Winch(dt=1e-3, effects=gear).step(speeds, volts) - told, rel=0.01)
    assert "load_dependent_friction@speed" in map(str, further_in(system()))


def test_of_a_speed_under_a_force_that_alone_is_drive():
    speed, force, h = np.array([[40.0]]), np.array([[2.0]]), 1e-4
    there = DrivenByForce(dt=h, effects=[LoadDependentFriction("speed", SHARE)])
    brake = there.step(speed, force) - DrivenByForce(dt=h).step(speed, force)
    assert brake[0, 0] == pytest.approx(-SHARE * 8.0 * 2.0 / 0.25 * h, rel=1e-3)


@pytest.mark.parametrize("system", [Hoist, Motor, Winch])
def test_rows_have_shares_of_their_own_and_none_changes_no_bit(system):
    plain, rng = system(), np.random.default_rng(0)
    joint = plain.joints[0].name
    states = rng.normal(0, 5, (4, len(plain.state_channels)))
    inputs, shares = rng.normal(0, 10, (4, 1)), np.array([0.0, 0.1, 0.3, 0.9])
    together = plain.with_effects([LoadDependentFriction(joint, shares)]).step(states, inputs)
    for i in range(1, 4):
        alone = plain.with_effects([LoadDependentFriction(joint, float(shares[i]))])
        assert np.array_equal(alone.step(states[[i]], inputs[[i]])[0], together[i])
    assert np.array_equal(together[:1], plain.step(states[:1], inputs[:1]))
    assert "failed" not in repr(
        check_simulator(plain.with_effects([LoadDependentFriction(joint, 0.2)]))
    )


class Towed(Arm):
    """The same with a second joint that nothing drives."""

    action_channels = Arm.action_channels[:1]

    def acceleration(self, q, v, u, force, p):
        return super().acceleration(q, v, np.concatenate([u, 0.0 * u], axis=1), force, p)


def test_it_is_for_joints_that_inputs_move_by_themselves():
    def geared(simulator):
        return [e.joint for e in further_in(simulator) if isinstance(e, LoadDependentFriction)]

    assert (geared(Arm()), geared(Towed()), geared(Pendulum())) == (["one", "two"], ["one"], [])

    class UnderVoltage(Hoist):
        action_channels = Motor.action_channels

    # What a voltage pushes hangs on the speed, which the equation of motion has to say.
    assert (geared(PendulumEquation()), geared(UnderVoltage())) == (["pivot"], [])
    with pytest.raises(ValueError, match="written as equations"):
        Pendulum(effects=[LoadDependentFriction("pivot", 0.1)])

    class Held(Hoist):
        joints = (Joint("height", "height", "speed", "N", driven=False),)

    with pytest.raises(ValueError, match="nothing drives 'height'"):
        Held(effects=[LoadDependentFriction("height", 0.1)])
