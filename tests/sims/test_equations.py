"""Systems that a user brings: two joints, first order, and what they are told when wrong."""

import itertools

import numpy as np
import pytest
from pendulum_reference import TIGHT
from scipy.integrate import solve_ivp

from sims.checks import check_simulator
from sims.effects import (
    CoulombFriction,
    StribeckFriction,
    ViscousFriction,
    exact_aliases,
    library,
)
from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.pendulum import Pendulum
from sims.pendulum_equation import PendulumEquation
from sims.simulator import Channel, Joint, Parameter
from sims.sliding import BLOCK

CART, POLE, ARM, GRAVITY = 0.5, 0.2, 0.3, 9.81


class CartPole(EquationOfMotion):
    """A point mass on a rod, hinged to a cart that a force pushes."""

    name = "cart-pole"
    dt = 0.02
    state_channels = (
        Channel("x", "m", "position"),
        Channel("angle", "rad", "position", angle=True),
        Channel("speed", "m/s", "rate", rate_of="x"),
        Channel("turning", "rad/s", "rate", rate_of="angle", scale=5.0),
    )
    action_channels = (Channel("push", "N", "input", scale=5.0, low=-10.0, high=10.0),)
    parameters = {
        "cart": Parameter(CART, "kg", "mass of the cart", low=0.01),
        "bob": Parameter(POLE, "kg", "mass at the end of the rod", low=0.01),
    }

    def acceleration(self, q, v, u, force, p):
        sine, cosine = np.sin(q[:, 1]), np.cos(q[:, 1])
        whole, arm = p.cart + p.bob, p.bob * ARM
        pull = u[:, 0] + force[:, 0] + arm * v[:, 1] * v[:, 1] * sine
        turn = force[:, 1] + arm * GRAVITY * sine
        det = whole * arm * ARM - (arm * cosine) ** 2
        return np.stack(
            [
                (arm * ARM * pull - arm * cosine * turn) / det,
                (whole * turn - arm * cosine * pull) / det,
            ],
            axis=1,
        )


def cart_pole_rates(y, u, force):
    """The same system from its mass matrix, independently of the class."""
    arm = POLE * ARM
    matrix = [[CART + POLE, arm * np.cos(y[1])], [arm * np.cos(y[1]), arm * ARM]]
    right = [u + arm * y[3] ** 2 * np.sin(y[1]), arm * GRAVITY * np.sin(y[1])]
    return np.linalg.solve(matrix, np.add(right, force))


def rows(n, seed=0):
    rng = np.random.default_rng(seed)
    return rng.uniform(-1, 1, (n, 4)) * [1, 3, 2, 5], rng.uniform(-8, 8, (n, 1))


def test_cart_pole_agrees_with_its_mass_matrix():
    states, actions = rows(20)
    found = CartPole().step(states, actions)
    for state, u, expected in zip(states, actions[:, 0], found, strict=True):
        truth = solve_ivp(
            lambda t, y, u=u: [*y[2:], *cart_pole_rates(y, u, [0, 0])], (0, 0.02), state, **TIGHT
        ).y[:, -1]
        assert expected == pytest.approx(truth, abs=1e-6)


def test_friction_on_one_joint_stops_it_while_the_other_moves():
    friction = 2.0
    simulator = CartPole(effects=[CoulombFriction("x", friction), ViscousFriction("angle", 0.02)])
    start = np.array([0.3, 2.5, 0.4, 1.0])
    found = simulator.rollout(start, np.zeros((15, 1)))

    def slides(_, y):
        return [*y[2:], *cart_pole_rates(y, 0.0, [-friction, -0.02 * y[3]])]

    def stops(_, y):
        return y[2]

    stops.terminal = True
    slide = solve_ivp(slides, (0, 0.3), start, events=stops, **TIGHT)
    rest = slide.y[:, -1]

    def swings(_, y):
        return [y[1], GRAVITY / ARM * np.sin(y[0]) - 0.02 * y[1] / (POLE * ARM**2)]

    swing = solve_ivp(swings, (slide.t[-1], 0.3), rest[[1, 3]], **TIGHT).y[:, -1]
    assert 0.02 < slide.t[-1] < 0.25
    assert found[-1] == pytest.approx([rest[0], swing[0], 0.0, swing[1]], abs=2e-5)
    held = found[:, 2] == 0.0
    assert held.sum() > 2 and len(np.unique(found[held, 0])) == 1


def test_a_held_joint_breaks_loose_when_the_other_pulls_hard_enough():
    simulator = CartPole(effects=[CoulombFriction("x", 1.0)])
    states = np.array([[0.0, np.pi / 2, 0.0, 0.0], [0.0, np.pi - 0.01, 0.0, 0.0]])
    after = simulator.step(states, np.zeros((2, 1)))
    assert after[1, 2] == 0.0 and after[1, 0] == 0.0
    hard = simulator.step(states, np.full((2, 1), 5.0))
    assert (hard[:, 2] > 0).all()


def test_cart_pole_keeps_the_contract_with_every_effect():
    findings = check_simulator(CartPole())
    assert all(finding.ok for finding in findings), "\n".join(map(str, findings))
    names = {str(effect) for effect in library(CartPole())}
    assert {"coulomb_friction@x", "cogging@angle", "delay@push", "bob"} <= names
    # A sliding joint has no cogging, and a drive that is not told has no play.
    assert not names & {"cogging@x", "backlash@x"}
    aliases = {frozenset(alias.effects) for alias in exact_aliases(CartPole())}
    assert frozenset({"constant_load@x", "actuator_bias@push"}) in aliases


@pytest.mark.parametrize(
    "effects",
    [
        (),
        (CoulombFriction("x", 2.0), CoulombFriction("angle", 0.3)),
        (StribeckFriction("x", 1.0, 2.0, 0.3), CoulombFriction("angle", 0.3)),
    ],
)
def test_a_row_that_diverges_is_seen_and_loses_only_itself(effects):
    simulator = CartPole(effects=effects)
    states, actions = rows(6)
    states[:, 2] = 0.0  # held carts need a system of equations to be solved
    states[:3, 3] = 0.0
    expected = simulator.step(states, actions)
    for column, value in itertools.product(range(4), (np.nan, np.inf, 1e200)):
        wild = states.copy()
        wild[1, column] = wild[4, column] = value
        with np.errstate(all="ignore"):
            found = simulator.step(wild, actions)
        assert np.array_equal(found[[0, 2, 3, 5]], expected[[0, 2, 3, 5]])
        if not np.isfinite(value):
            assert not np.isfinite(found[[1, 4]]).all(axis=1).any()
    assert np.isfinite(expected).all()


def test_what_an_equation_does_not_know_is_not_hidden_by_friction():
    class Blind(CartPole):
        def acceleration(self, q, v, u, force, p):
            return np.where(q > 0.5, np.nan, super().acceleration(q, v, u, force, p))

    simulator = Blind(effects=[CoulombFriction("x", 50.0), CoulombFriction("angle", 50.0)])
    states = np.array([[0.0, 0.0, 0.0, 0.0], [0.0, 0.6, 0.0, 0.0]])
    found = simulator.step(states, np.zeros((2, 1)))
    assert np.array_equal(found[0], states[0]) and np.isnan(found[1]).any()


class Chain(EquationOfMotion):
    """Three masses in a row, coupled by their inertia: M q'' = force, M full and constant."""

    name = "chain"
    dt = 0.02
    state_channels = tuple(
        channel
        for i in "abc"
        for channel in (
            Channel(i, "m", "position"),
            Channel(f"v{i}", "m/s", "rate", rate_of=i),
        )
    )
    action_channels = (Channel("push", "N", "input", scale=5.0),)
    mass = np.array([[2.0, 0.5, 0.2], [0.5, 1.5, 0.4], [0.2, 0.4, 1.0]])

    def acceleration(self, q, v, u, force, p):
        total = force + u * [1.0, 0.0, 0.5]
        rows = np.linalg.inv(self.mass)
        return np.stack([sum(rows[i, j] * total[:, j] for j in range(3)) for i in range(3)], axis=1)


def test_friction_holds_some_of_three_joints():
    levels = {"a": 0.5, "b": 3.0, "c": 4.0}
    chain = Chain(effects=[CoulombFriction(name, level) for name, level in levels.items()])
    found = chain.step(np.zeros((2, 6)), [[3.0], [0.4]])
    # Only the first mass slides: the others are held by what its acceleration pulls with.
    acceleration = (3.0 - 0.5) / 2.0
    assert 0.5 * acceleration < 3.0 and abs(1.5 - 0.2 * acceleration) < 4.0
    assert found[0] == pytest.approx([0.5 * acceleration * 4e-4, acceleration * 0.02, 0, 0, 0, 0])
    assert np.array_equal(found[0, 2:], np.zeros(4)) and np.array_equal(found[1], np.zeros(6))


def test_many_rows_are_split_without_a_trace():
    n = BLOCK + 5
    states, actions = rows(n)
    simulator = CartPole(effects=[CoulombFriction("x", np.linspace(0.0, 1.0, n))])
    found = simulator.step(states, actions)
    last = simulator.take(slice(n - 3, n)).step(states[-3:], actions[-3:])
    assert np.array_equal(found[-3:], last)


def test_force_scale_is_what_sets_up_a_typical_rate_in_ten_periods():
    simulator = CartPole()
    cart = next(joint for joint in simulator.joints if joint.name == "x")
    assert cart == Joint("x", "x", "speed", "N")
    # Upright at rest, a force on the cart moves it as if the bob hung on a massless hinge.
    assert simulator.force_scale(cart) == pytest.approx(1.0 / 0.2 * CART)
    # It follows what the system is, not what was asked last.
    heavier, faster = simulator.with_parameters(cart=2 * CART), CartPole(dt=simulator.dt / 2)
    assert heavier.force_scale(cart) == pytest.approx(2.0 / 0.2 * CART)
    assert faster.force_scale(cart) == pytest.approx(2.0 / 0.2 * CART)
    assert simulator.with_scales({"speed": 3.0}).force_scale(cart) == pytest.approx(15.0 * CART)
    rubbed = simulator.with_effects([CoulombFriction("x", 1.0)])
    assert rubbed.force_scale(cart) == pytest.approx(1.0 / 0.2 * CART)


def test_the_two_pendulums_agree():
    rng = np.random.default_rng(4)
    states = np.c_[rng.uniform(-np.pi, np.pi, 50), rng.uniform(-15, 15, 50)]
    actions = rng.uniform(-3, 3, (50, 1))
    for options in ({}, {"mass": 0.09}, {"mass": 0.09, "inertia_follows_mass": True}):
        difference = Pendulum(**options).step(states, actions) - PendulumEquation(**options).step(
            states, actions
        )
        assert (np.abs(difference).max(axis=0) < [1e-6, 1e-5]).all()


def test_a_rate_without_its_position_is_explained():
    class Lost(CartPole):
        state_channels = (Channel("speed", "m/s", "rate"),)

    with pytest.raises(ValueError, match="rate_of"):
        Lost()


def test_a_state_that_is_neither_position_nor_rate_is_explained():
    class Warm(CartPole):
        state_channels = (*CartPole.state_channels, Channel("heat", "K", "other"))

    with pytest.raises(ValueError, match="FirstOrderSystem"):
        Warm()


def test_a_force_that_is_added_as_it_is_counts_as_an_acceleration():
    """And of a mass in kg that happens to be 1 it does not."""

    class Bowl(EquationOfMotion):
        state_channels = (
            Channel("x", "px", "position"), Channel("x rate", "px/s", "rate", rate_of="x"),
            Channel("tilt", "rad", "position"),
            Channel("tilt rate", "rad/s", "rate", rate_of="tilt"),
            Channel("z", "m", "position"), Channel("z rate", "m/s", "rate", rate_of="z"),
        )  # fmt: skip
        action_channels = ()
        parameters = {
            "stiffness": Parameter(5.0, "1/s^2", "slope"), "mass": Parameter(1.0, "kg", "mass"),
        }  # fmt: skip

        def acceleration(self, q, v, u, force, p):
            pulled = force - p.stiffness * q
            return np.stack([pulled[:, 0], pulled[:, 1], force[:, 2] / p.mass], axis=1)

    assert [joint.unit for joint in Bowl().joints] == ["px/s/s", "rad/s/s", "N"]


def test_an_acceleration_of_the_wrong_shape_is_explained():
    class Careless(CartPole):
        def acceleration(self, q, v, u, force, p):
            return force[:, 0] / p.cart

    with pytest.raises(ValueError, match=r"returned shape \(3,\), expected \(3, 2\)"):
        Careless().step(*rows(3))


def test_a_method_of_other_arguments_is_explained():
    class Heater(FirstOrderSystem):
        state_channels = (Channel("heat", "K", "other"),)
        action_channels = (Channel("power", "W", "input"),)

        def derivative(self, x, u, force, p):
            return u + force

    with pytest.raises(ValueError, match=r"'p'; expected derivative\(self, x, u, p\)"):
        Heater()


def test_an_angle_that_wraps_is_in_rad():
    with pytest.raises(ValueError, match=r"'sway' has angle=True and unit='deg', expected 'rad'"):
        Channel("sway", "deg", "position", angle=True)
    Channel("sway", "deg", "position")


def test_a_channel_of_no_kind_is_refused():
    with pytest.raises(ValueError, match=r"'x' has kind='positoin', expected one of 'position', "):
        Channel("x", "m", "positoin")
