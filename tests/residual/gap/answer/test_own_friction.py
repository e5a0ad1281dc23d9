"""Friction that no law of the library follows is named as what it is: a curve."""

import numpy as np
import pytest

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.effects import FrictionCurve
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter


class Rotor(FirstOrderSystem):
    dt = 0.02
    state_channels = (Channel("speed", "rad/s", "rate", scale=30.0),)
    action_channels = (Channel("torque", "1", "input", scale=20.0, low=-40.0, high=40.0),)

    def derivative(self, x, u, p):
        return 5.0 * u


class DampedRotor(Rotor):
    """One whose author expects a damping."""

    parameters = {"damping": Parameter(5.0, "1/s", "of the bearing", low=0.0)}

    def derivative(self, x, u, p):
        return 5.0 * u - (p.damping * x[:, 0])[:, None]


#: Enough to be wrong with.
OFFERED = ("viscous_friction", "quadratic_drag", "coulomb_friction", "constant_load", "delay")


def log(friction, seed):
    """A rotor's speed under steps of 0.8 s, slowed down by a function of the speed, by RK4."""
    rng = np.random.default_rng(seed)
    torque = np.repeat(rng.uniform(-9, 9, 25), 40)
    speed, h = [0.0], 0.005
    for push in torque:
        v = speed[-1]
        for _ in range(4):
            k1 = 5.0 * push - friction(v)
            k2 = 5.0 * push - friction(v + 0.5 * h * k1)
            k3 = 5.0 * push - friction(v + 0.5 * h * k2)
            k4 = 5.0 * push - friction(v + h * k3)
            v += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        speed.append(v)
    seen = np.array(speed)[:, None] + rng.normal(0, 0.05, (len(speed), 1))
    return Trajectory(f"steps {seed}", 0.02 * np.arange(len(speed)), seen, torque[:, None])


def eddy_brake(v):
    return 3.0 * v / (1.0 + (v / 20.0) ** 2)


@pytest.fixture(scope="module")
def braked():
    held = [log(eddy_brake, 2)]
    return find_gap(Rotor(), [log(eddy_brake, 0), log(eddy_brake, 1)], held=held, effects=OFFERED)


def test_a_brake_that_weakens_with_speed_is_a_curve(braked):
    named = [v for v in braked.verdicts if v.kind in ("confirmed", "ambiguous")]
    assert [(v.kind, v.effect) for v in named] == [("confirmed", "friction_curve")]
    (curve,) = braked.effects
    assert isinstance(curve, FrictionCurve)
    for field in ("slow", "medium"):
        speed, _ = curve.point_of(field)
        assert named[0].parameters[field].value == pytest.approx(eddy_brake(speed), rel=0.05)
    assert braked.gap.share.value > 0.999


def test_it_explains_records_set_aside(braked):
    assert braked.held_out.after.value < 0.02 * braked.held_out.before.value


def test_what_the_library_has_is_named_by_it():
    logs = [log(lambda v: 2.0 * v, seed) for seed in (0, 1)]
    viscous = find_gap(Rotor(), logs, effects=OFFERED)
    assert [v.effect for v in viscous.verdicts if v.kind == "confirmed"] == ["viscous_friction"]


def test_a_remainder_that_does_not_follow_speed_leaves_the_laws_of_the_library():
    def shaken(seed):
        clean = log(lambda v: 2.0 * v, seed)
        rng = np.random.default_rng(100 + seed)
        wander = np.cumsum(rng.normal(0, 0.08, len(clean.times)))
        return Trajectory(clean.name, clean.times, clean.states + wander[:, None], clean.actions)

    found = find_gap(Rotor(), [shaken(0), shaken(1)], effects=OFFERED)
    assert not any(isinstance(effect, FrictionCurve) for effect in found.effects)
    assert "viscous_friction" in {v.effect for v in found.verdicts}


def test_a_damping_of_the_simulator_s_own_makes_no_difference():
    found = find_gap(
        DampedRotor(),
        [log(eddy_brake, 0), log(eddy_brake, 1)],
        effects=(*OFFERED, "damping"),
    )
    assert any(isinstance(effect, FrictionCurve) for effect in found.effects)
    assert found.gap.share.value > 0.99
