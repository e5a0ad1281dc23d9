"""None"""

import math

import numpy as np
import pytest
from hosts import HOSTS, host, rows
from hypothesis import given, settings
from hypothesis import strategies as st
from pendulum_reference import INERTIA, LENGTH, K, R, dry_step, play_step, smooth_step

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
    LinearSpring,
    ParameterChange,
    QuadraticActuator,
    QuadraticDrag,
    Saturation,
    SensorOffset,
    SensorScale,
    StribeckFriction,
    ViscousFriction,
    library,
    typical,
)
from sims.pendulum import Pendulum


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
    "curve": (
        QuadraticActuator("voltage", 0.4, 3.0),
        lambda s, u: smooth_step(s, 0.6 * u + 0.4 * u * abs(u) / 3.0),
        (1e-6, 1e-5),
    ),
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
@settings(max_examples=15)
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
