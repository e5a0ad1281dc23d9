"""Every effect on both hosts: against written-out equations, at zero strength, by row."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pendulum_reference import INERTIA, LENGTH, G, K, R, dry_step, play_step, smooth_step

from sims.effects import (
    ActuatorBias,
    ActuatorGain,
    ActuatorLag,
    Backlash,
    Cogging,
    ConstantLoad,
    CoulombFriction,
    CubicSpring,
    DeadZone,
    Delay,
    DirectionalFriction,
    DryFriction,
    JointEffect,
    LinearSpring,
    ParameterChange,
    QuadraticDrag,
    Saturation,
    SensorOffset,
    SensorScale,
    StribeckFriction,
    ViscousFriction,
    exact_aliases,
    library,
    number,
    typical,
)
from sims.pendulum import Pendulum
from sims.pendulum_equation import PendulumEquation

HOSTS = {"pymunk": Pendulum(), "equation": PendulumEquation()}
host = pytest.mark.parametrize("host", HOSTS)


def rows(n, seed=0):
    rng = np.random.default_rng(seed)
    states = np.c_[rng.uniform(-np.pi, np.pi, n), rng.uniform(-12, 12, n)]
    return states, rng.uniform(-3, 3, (n, 1))


def changed(name, change):
    constants = {"mass": 0.055, "inertia": INERTIA, "length": LENGTH}
    if name in constants:
        return lambda s, u: smooth_step(s, u, **{name: constants[name] + change})
    weight = 0.055 * LENGTH
    other = {
        "gravity": lambda q, w, u: change * weight * math.sin(q),
        "damping": lambda q, w, u: -change * w,
        "torque_constant": lambda q, w, u: change / R * u - ((K + change) ** 2 - K**2) / R * w,
        "resistance": lambda q, w, u: (1 / (R + change) - 1 / R) * (K * u - K**2 * w),
    }[name]
    return lambda s, u: smooth_step(s, u, lambda q, w: other(q, w, u))


def dead(u, width):
    return math.copysign(max(abs(u) - width, 0.0), u)


def stribeck(w, _):
    return 1e-3 + 1.5e-3 * math.exp(-((w / 0.8) ** 2))


# Effect, one control period of it by SciPy, and how closely angle and rate have to agree.
EQUATIONS = {
    "viscous": (
        ViscousFriction("pivot", 3e-4),
        lambda s, u: smooth_step(s, u, lambda q, w: -3e-4 * w),
        (1e-6, 1e-5),
    ),
    "drag": (
        QuadraticDrag("pivot", 2e-5),
        lambda s, u: smooth_step(s, u, lambda q, w: -2e-5 * w * abs(w)),
        (1e-6, 1e-5),
    ),
    "spring": (
        LinearSpring("pivot", 3e-3, 0.4),
        lambda s, u: smooth_step(s, u, lambda q, w: -3e-3 * (q - 0.4)),
        (1e-6, 1e-5),
    ),
    "cubic": (
        CubicSpring("pivot", 1e-3),
        lambda s, u: smooth_step(s, u, lambda q, w: -1e-3 * q**3),
        (1e-6, 2e-5),
    ),
    "load": (
        ConstantLoad("pivot", 3e-3),
        lambda s, u: smooth_step(s, u, lambda q, w: 3e-3),
        (1e-6, 1e-5),
    ),
    "cogging": (
        Cogging("pivot", 2e-3, 1e-3, 5),
        lambda s, u: smooth_step(
            s, u, lambda q, w: 2e-3 * math.sin(5 * q) + 1e-3 * math.cos(5 * q)
        ),
        (1e-6, 2e-5),
    ),
    "coulomb": (
        CoulombFriction("pivot", 2e-3),
        lambda s, u: dry_step(s, u, lambda w, _: 2e-3),
        (5e-6, 5e-5),
    ),
    "stribeck": (
        StribeckFriction("pivot", 1e-3, 2.5e-3, 0.8),
        lambda s, u: dry_step(s, u, stribeck),
        (1e-5, 2e-4),
    ),
    "directional": (
        DirectionalFriction("pivot", 3e-3, 5e-4),
        lambda s, u: dry_step(s, u, lambda _, side: 3e-3 if side > 0 else 5e-4),
        (5e-6, 5e-5),
    ),
    "gain": (ActuatorGain("voltage", 0.2), lambda s, u: smooth_step(s, 1.2 * u), (1e-6, 1e-5)),
    "bias": (ActuatorBias("voltage", 0.3), lambda s, u: smooth_step(s, u + 0.3), (1e-6, 1e-5)),
    "dead zone": (
        DeadZone("voltage", 0.6),
        lambda s, u: smooth_step(s, dead(u, 0.6)),
        (1e-6, 1e-5),
    ),
    "saturation": (
        Saturation("voltage", 1.5),
        lambda s, u: smooth_step(s, min(max(u, -1.5), 1.5)),
        (1e-6, 1e-5),
    ),
    # The past input is -u; it changes to u inside the period.
    "delay": (
        Delay("voltage", 0.0225),
        lambda s, u: smooth_step(s, lambda t: u if t > 0.0225 else -u, jumps=(0.0225,)),
        (3e-6, 5e-5),
    ),
    "lag": (
        ActuatorLag("voltage", 0.03),
        lambda s, u: smooth_step(s, lambda t: u - 2 * u * math.exp(-t / 0.03)),
        (1e-6, 1e-5),
    ),
    "offset": (
        SensorOffset("angle", 0.1),
        lambda s, u: np.add(smooth_step(s - [0.1, 0], u), [0.1, 0]),
        (1e-6, 1e-5),
    ),
    "scale": (
        SensorScale("rate", 0.05),
        lambda s, u: smooth_step(s / [1, 1.05], u) * [1, 1.05],
        (1e-6, 1e-5),
    ),
} | {
    name: (ParameterChange(name, change), changed(name, change), (1e-6, 1e-5))
    for name, change in {
        "mass": 0.02,
        "inertia": 3e-5,
        "length": 0.005,
        "gravity": -1.0,
        "damping": 1e-4,
        "torque_constant": 0.01,
        "resistance": 2.0,
    }.items()
}


@host
@pytest.mark.parametrize("name", EQUATIONS)
def test_effect_obeys_its_equation(host, name):
    effect, reference, tolerance = EQUATIONS[name]
    simulator = HOSTS[host].with_effects([effect])
    states, actions = rows(25)
    found = simulator.step(simulator.augment(states, -actions), actions)[:, :2]
    truth = np.array([reference(s, u) for s, u in zip(states, actions[:, 0], strict=True)])
    assert (np.abs(found - truth).max(axis=0) < tolerance).all()
    nominal = HOSTS[host].step(states, actions)
    assert np.abs(found - nominal).max() > 20 * np.abs(found - truth).max()


@host
def test_backlash_obeys_its_equation(host):
    simulator = HOSTS[host].with_effects([Backlash("pivot", 0.2)])
    states, actions = rows(25, seed=3)
    start = simulator.augment(states, -actions)
    start[::3, 2] *= 0.5
    found = simulator.step(start, actions)
    truth = np.array([play_step(s, u, 0.2) for s, u in zip(start, actions[:, 0], strict=True)])
    assert (np.abs(found - truth).max(axis=0) < [1e-5, 2e-4, 1e-5]).all()
    assert np.abs(found[:, :2] - HOSTS[host].step(states, actions)).max() > 0.05


def test_two_plays_of_one_drive_are_one_of_their_sum():
    states, actions = rows(25, seed=3)
    one, two = (
        Pendulum(effects=[Backlash("pivot", width) for width in widths])
        for widths in ((0.2,), (0.15, 0.05))
    )
    wanted = one.step(one.augment(states, -actions), actions)
    found = two.step(two.augment(states, -actions), actions)
    assert found[:, :2] == pytest.approx(wanted[:, :2], abs=1e-12)
    assert found[:, 2:] == pytest.approx(wanted[:, 2:] * [0.75, 0.25], abs=1e-12)


@host
@pytest.mark.parametrize("effect", library(Pendulum()), ids=str)
def test_zero_strength_keeps_every_bit(host, effect):
    states, actions = rows(8)
    nominal = HOSTS[host]
    expected = nominal.step(states, actions)
    simulator = nominal.with_effects([effect])
    assert simulator.state_channels == nominal.state_channels
    assert np.array_equal(simulator.step(states, actions), expected)
    # Beside rows in which the effect is there, rows at zero strength keep theirs.
    some = typical(effect, nominal)
    mixed = effect.with_values(
        **{
            name: np.where(np.arange(8) % 2, getattr(some, name), getattr(effect, name))
            for name in effect.strengths()
        }
    )
    simulator = nominal.with_effects([mixed])
    found = simulator.step(simulator.augment(states, -actions), actions)[:, :2]
    assert np.array_equal(found[::2], expected[::2])
    assert (found[1::2] != expected[1::2]).any()


@host
@pytest.mark.parametrize("effect", library(Pendulum()), ids=str)
def test_values_by_row_equal_a_loop_over_scalars(host, effect):
    states, actions = rows(5, seed=1)
    nominal = HOSTS[host]
    shares = np.linspace(0.4, 1.2, 5)
    each = [typical(effect, nominal, share) for share in shares]
    together = effect.with_values(
        **{name: np.array([getattr(e, name) for e in each]) for name in effect.strengths()}
    )
    simulator = nominal.with_effects([together])
    found = simulator.step(simulator.augment(states, -actions), actions)
    for i, alone in enumerate(each):
        single = nominal.with_effects([alone])
        start = single.augment(states[i : i + 1], -actions[i : i + 1])
        assert np.array_equal(single.step(start, actions[i : i + 1])[0, :2], found[i, :2])


@host
@settings(deadline=None, max_examples=15)
@given(
    st.lists(
        st.tuples(st.floats(-9, 9), st.sampled_from([0.0, 0.1, -3.0, 11.0]), st.floats(-3, 3)),
        min_size=2,
        max_size=5,
    )
)
def test_rows_with_everything_at_once_are_pure(host, table):
    simulator = HOSTS[host].with_effects(
        [
            StribeckFriction("pivot", 1e-3, 2e-3, 0.5),
            QuadraticDrag("pivot", 1e-5),
            Backlash("pivot", 0.1),
            Delay("voltage", 0.07),
            ActuatorLag("voltage", 0.02),
            SensorScale("angle", 0.01),
        ]
    )
    table = np.array(table)
    actions = table[:, 2:]
    states = simulator.augment(table[:, :2], -actions)
    together = simulator.step(states, actions)
    assert np.isfinite(together).all()
    assert np.array_equal(simulator.step(states[::-1], actions[::-1]), together[::-1])
    for i in range(len(states)):
        alone = simulator.step(states[i : i + 1], actions[i : i + 1])
        assert np.array_equal(alone[0], together[i])


@host
@pytest.mark.parametrize(
    "friction", [CoulombFriction("pivot", 4e-3), StribeckFriction("pivot", 1e-3, 4e-3, 0.5)]
)
def test_what_friction_holds_does_not_creep(host, friction):
    simulator = HOSTS[host].with_effects([friction])
    # 0.1 rad off hanging: gravity pulls with 2.3e-3 N m, less than the friction holds.
    start = np.array([np.pi - 0.1, 0.0])
    path = simulator.rollout(start, np.zeros((200, 1)))
    assert np.array_equal(path, np.tile(start, (201, 1)))
    # A voltage that pulls harder than friction and gravity together moves it.
    assert simulator.rollout(start, np.full((2, 1), 3.0))[-1, 1] != 0


@host
def test_friction_that_differs_by_direction_holds_one_way_and_slips_the_other(host):
    # 0.1 rad off hanging, gravity pulls back with 2.3e-3 N m.
    start = np.array([[np.pi - 0.1, 0.0], [np.pi + 0.1, 0.0]])
    for levels, held in (((3e-3, 1e-3), 0), ((1e-3, 3e-3), 1), ((3e-3, 3e-3), 2)):
        simulator = HOSTS[host].with_effects([DirectionalFriction("pivot", *levels)])
        stays = (simulator.step(start, np.zeros((2, 1))) == start).all(axis=1)
        assert np.array_equal(stays, {0: [True, False], 1: [False, True], 2: [True, True]}[held])


@host
def test_a_swing_with_dry_friction_comes_to_rest_in_finite_time(host):
    simulator = HOSTS[host].with_effects([CoulombFriction("pivot", 2e-3)])
    path = simulator.rollout([np.pi - 1.5, 0.0], np.zeros((60, 1)))
    assert path[-1, 1] == 0.0 and path[-1, 0] == path[-2, 0]
    assert abs(0.055 * G * LENGTH * math.sin(path[-1, 0])) <= 2e-3


def test_dissipation_takes_energy():
    states, _ = rows(20, seed=5)
    actions = np.zeros((20, 1))

    def energy(states):
        potential = 0.055 * G * LENGTH * np.cos(states[:, 0])
        return 0.5 * INERTIA * states[:, 1] ** 2 + potential

    nominal = energy(HOSTS["equation"].step(states, actions))
    for effect in (
        ViscousFriction("pivot", 1e-4),
        QuadraticDrag("pivot", 1e-5),
        CoulombFriction("pivot", 1e-4),
        StribeckFriction("pivot", 1e-4, 2e-4, 0.5),
    ):
        simulator = HOSTS["equation"].with_effects([effect])
        assert (energy(simulator.step(states, actions)) < nominal + 1e-9).all()


def test_units_and_scales_come_from_the_host():
    units = {
        str(effect): {name: q.unit for name, q in effect.quantities(Pendulum()).items()}
        for effect in library(Pendulum())
    }
    assert units["viscous_friction@pivot"]["coefficient"] == "N m s/rad"
    assert units["quadratic_drag@pivot"]["coefficient"] == "N m s^2/rad^2"
    assert units["cubic_spring@pivot"]["stiffness"] == "N m/rad^3"
    assert units["stribeck_friction@pivot"]["speed"] == "rad/s"
    assert units["backlash@pivot"]["width"] == "rad"
    assert units["dead_zone@voltage"]["width"] == "V"
    assert units["delay@voltage"]["time"] == "s"
    assert units["sensor_scale@angle"]["scale"] == "1"
    assert units["mass"]["change"] == "kg"


def test_library_names_every_effect_and_bounds_what_dissipates():
    effects = library(Pendulum())
    assert {effect.name for effect in effects} >= {
        *("viscous_friction", "coulomb_friction", "stribeck_friction", "quadratic_drag"),
        *("linear_spring", "cubic_spring", "constant_load", "cogging", "mass", "inertia"),
        *("length", "actuator_gain", "actuator_bias", "dead_zone", "saturation", "delay"),
        *("actuator_lag", "backlash", "sensor_offset", "sensor_scale"),
    }
    for effect in effects:
        assert effect.absent and effect.sentence and effect.needs
        for quantity in effect.quantities(Pendulum()).values():
            assert quantity.scale > 0 and quantity.low < quantity.high
    low = {
        effect.name: effect.quantities(Pendulum())[effect.strengths()[0]].low for effect in effects
    }
    for name in ("viscous_friction", "coulomb_friction", "linear_spring", "delay", "backlash"):
        assert low[name] == 0


@pytest.mark.parametrize("host", HOSTS)
def test_exact_aliases(host):
    found = {frozenset(alias.effects) for alias in exact_aliases(HOSTS[host])}
    assert frozenset({"constant_load@pivot", "actuator_bias@voltage"}) in found
    assert frozenset({"mass", "length", "gravity"}) in found
    assert (
        frozenset({"viscous_friction@pivot", "actuator_gain@voltage", "torque_constant"}) in found
    )
    four = {"viscous_friction@pivot", "actuator_gain@voltage", "mass", "inertia"}
    assert frozenset(four) in found
    following = exact_aliases(PendulumEquation(inertia_follows_mass=True))
    twins = [set(alias.effects) for alias in following if "the same motion" in alias.says]
    assert twins and not any("mass" in names for names in twins)


@pytest.mark.parametrize(
    ("effect", "message"),
    [
        (ViscousFriction("knee", 1.0), "joint 'knee'.*pivot"),
        (Delay("torque", 1.0), "actuator 'torque'.*voltage"),
        (SensorOffset("speed", 1.0), "channel 'speed'.*angle, rate"),
        (ParameterChange("weight", 1.0), "parameter 'weight'.*mass"),
    ],
)
def test_a_wrong_place_lists_the_right_ones(effect, message):
    with pytest.raises(ValueError, match=message):
        Pendulum().with_effects([effect])


def test_values_for_different_numbers_of_rows_are_refused():
    with pytest.raises(ValueError, match="rows"):
        _ = StribeckFriction("pivot", np.ones(3), np.ones(4)).rows


@dataclasses.dataclass(frozen=True)
class FanTorque(JointEffect):
    level: float = number(force=1, rate=-3, low=0.0)
    name = "fan_torque"
    sentence = "A torque that grows with the cube of speed."
    needs = "fast motion"

    def force(self, q, v):
        return -self.level * v * v * v


@host
def test_an_effect_of_the_users_own_is_hosted(host):
    effect = FanTorque("pivot", 2e-6)
    assert effect.quantities(HOSTS[host])["level"].unit == "N m s^3/rad^3"
    states, actions = rows(10)
    found = HOSTS[host].with_effects([effect]).step(states, actions)
    truth = [
        smooth_step(s, u, lambda q, w: -2e-6 * w**3)
        for s, u in zip(states, actions[:, 0], strict=True)
    ]
    assert found == pytest.approx(np.array(truth), abs=2e-5)


def test_every_effect_says_which_family_it_belongs_to():
    pendulum = Pendulum()
    families = {str(effect): effect.family_in(pendulum) for effect in library(pendulum)}
    assert {name for name, family in families.items() if family == "dissipation"} == {
        "viscous_friction@pivot",
        "coulomb_friction@pivot",
        "stribeck_friction@pivot",
        "directional_friction@pivot",
        "quadratic_drag@pivot",
        "damping",
    }
    assert families["mass"] == families["actuator_gain@voltage"] == ""
    dry = {effect.name for effect in library(pendulum) if effect.subfamily == "dry friction"}
    assert dry == {"coulomb_friction", "stribeck_friction", "directional_friction"}
    (general,) = [e for e in library(pendulum) if e.name == "directional_friction"]
    states, actions = rows(6)
    for name in general.special_cases:
        (special,) = [typical(e, pendulum) for e in library(pendulum) if e.name == name]
        equal = general.with_values(forward=special.level, backward=special.level)
        one, other = (pendulum.with_effects([e]).step(states, actions) for e in (special, equal))
        assert np.array_equal(one, other)
    before_the_sensor = {e.name for e in library(pendulum) if e.upstream_of_sensor}
    assert before_the_sensor == {"dead_zone", "saturation", "actuator_lag"}


def test_a_spring_may_rest_anywhere_and_is_absent_without_stiffness():
    for kind in (LinearSpring, CubicSpring):
        rest = kind("pivot").quantities(Pendulum())["rest"]
        assert rest.role == "shape" and rest.starts == (-0.5, 0.0, 0.5)
        assert kind("pivot", 0.0, 0.4).absent
        assert not np.any(kind("pivot", np.zeros(3), np.ones(3)).present())
        assert next(e for e in library(Pendulum()) if isinstance(e, kind)) == kind("pivot")


@dataclasses.dataclass(frozen=True)
class Seal(DryFriction):
    level: float = number(force=1, low=0.0)
    name = "seal"
    sentence = "Dry friction of the user's own."
    needs = "reversals of the motion"

    def limit(self, v):
        return self.level + 0.0 * v


@dataclasses.dataclass(frozen=True)
class Magnet(JointEffect):
    level: float = number(force=1)
    name = "magnet"
    sentence = "A torque of the user's own that depends on the angle alone."
    needs = "whole turns"
    follows_rate = False

    def force(self, q, v):
        return self.level * np.sin(3 * q)


@host
def test_effects_of_the_users_own_move_like_those_of_the_library(host):
    states, actions = rows(12)
    states[::3, 1] = 0.0
    levels = np.where(np.arange(12) % 2, 2e-3, 0.0)
    for own, known in (
        (Seal("pivot", levels), CoulombFriction("pivot", levels)),
        (Magnet("pivot", levels), Cogging("pivot", levels, 0.0, 3.0)),
    ):
        found, wanted = (HOSTS[host].with_effects([e]).step(states, actions) for e in (own, known))
        assert found == pytest.approx(wanted, abs=1e-12)
        assert np.array_equal(found[::2], HOSTS[host].step(states, actions)[::2])


@host
def test_what_goes_wrong_in_an_effect_of_the_users_own_is_raised(host):
    class Broken(Magnet):
        def force(self, q, v):
            raise KeyError("level of the magnet")

    with pytest.raises(KeyError, match="level of the magnet"):
        HOSTS[host].with_effects([Broken("pivot", 1e-3)]).step(*rows(2))
