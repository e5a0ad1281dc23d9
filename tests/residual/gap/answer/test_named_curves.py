"""What no law of the library follows is named as what it is: a curve by points."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import PchipInterpolator

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.effects import (
    Curve,
    ForceCurve,
    FrictionCurve,
    InputCurve,
    StateCurve,
    SymmetricInputCurve,
)
from sims.equations import EquationOfMotion, FirstOrderSystem
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
    return find_gap(Rotor(), [log(eddy_brake, 0)], held_out=[log(eddy_brake, 2)], effects=OFFERED)


@pytest.mark.long
def test_a_brake_that_weakens_with_speed_is_a_curve(braked):
    named = [v for v in braked.verdicts if v.kind in ("confirmed", "ambiguous")]
    assert [(v.kind, v.effect) for v in named] == [("confirmed", "friction_curve")]
    (curve,) = braked.effects
    assert isinstance(curve, FrictionCurve)
    for field in ("slow", "medium"):
        speed, _ = curve.point_of(field)
        assert named[0].parameters[field].value == pytest.approx(eddy_brake(speed), rel=0.05)
    assert braked.gap.share.value > 0.999


@pytest.mark.parametrize(
    "name", [pytest.param("friction_curve", marks=pytest.mark.long), "friction_curve@speed"]
)
def test_a_curve_may_be_asked_for_by_name(name):
    logs = [log(eddy_brake, 0)]
    found = find_gap(Rotor(), logs, effects=("coulomb_friction", name))
    assert [(v.kind, v.effect) for v in found.verdicts[:1]] == [("confirmed", "friction_curve")]
    fastest = max(np.abs(one.states).max() for one in logs)
    assert found.effects[0].full == pytest.approx(fastest, rel=0.01)  # over what the log holds


def test_a_curve_with_more_numbers_than_the_log_can_tell_is_told():
    short = log(eddy_brake, 0)
    short = Trajectory("short", short.times[:40], short.states[:40], short.actions[:39])
    found = find_gap(Rotor(), [short], effects=("input_curve",), horizon=0.3)
    assert not found.effects
    assert any("input_curve@torque was not tried" in one.says for one in found.quality)


@pytest.mark.long
def test_it_explains_records_set_aside(braked):
    assert braked.held_out.after.value < 0.02 * braked.held_out.before.value


def test_what_the_library_has_is_named_by_it():
    logs = [log(lambda v: 2.0 * v, seed) for seed in (0, 1)]
    viscous = find_gap(Rotor(), logs, effects=OFFERED)
    assert [v.effect for v in viscous.verdicts if v.kind == "confirmed"] == ["viscous_friction"]


@pytest.mark.long
def test_a_remainder_that_does_not_follow_speed_leaves_the_laws_of_the_library():
    def shaken(seed):
        clean = log(lambda v: 2.0 * v, seed)
        rng = np.random.default_rng(100 + seed)
        wander = np.cumsum(rng.normal(0, 0.08, len(clean.times)))
        return Trajectory(clean.name, clean.times, clean.states + wander[:, None], clean.actions)

    found = find_gap(Rotor(), [shaken(0)], effects=OFFERED)
    assert not any(isinstance(effect, Curve) for effect in found.effects)
    assert "viscous_friction" in {v.effect for v in found.verdicts}


@pytest.mark.long
def test_a_damping_of_the_simulator_s_own_makes_no_difference():
    offered = ("viscous_friction", "quadratic_drag", "coulomb_friction", "damping")
    found = find_gap(DampedRotor(), [log(eddy_brake, 0)], effects=offered)
    assert any(isinstance(effect, FrictionCurve) for effect in found.effects)
    assert found.gap.share.value > 0.99


class Cart(EquationOfMotion):
    """A cart on a linear spring and a dashpot."""

    dt = 0.02
    state_channels = (
        Channel("x", "m", "position", scale=0.3),
        Channel("v", "m/s", "rate", scale=1.0, rate_of="x"),
    )
    action_channels = (Channel("push", "N", "input", scale=5.0, low=-10.0, high=10.0),)
    parameters = {"stiffness": Parameter(20.0, "N/m", "of the spring", low=0.0)}

    def acceleration(self, q, v, u, force, p):
        return (u[:, 0] - p.stiffness * q[:, 0] - v[:, 0] + force[:, 0])[:, None]


class Tank(FirstOrderSystem):
    """Its outflow is taken for proportional to the level."""

    dt = 5.0
    state_channels = (Channel("level", "m", "other", scale=1.0),)
    action_channels = (Channel("flow", "l/s", "input", scale=2.0, low=0.0, high=4.0),)
    parameters = {"outflow": Parameter(0.01, "1/s", "of the valve", low=0.0)}

    def derivative(self, x, u, p):
        return 0.005 * u - (p.outflow * x[:, 0])[:, None]


def integrated(rhs, start, inputs, dt, noise, seed):
    """A log by SciPy's adaptive integrator, inputs held for 25 samples each."""
    rng = np.random.default_rng(seed)
    states = [np.array(start, float)]
    for u in inputs[::25]:
        within = dt * np.arange(1, 26)
        path = solve_ivp(
            lambda t, x, u=u: rhs(x, u), (0, within[-1]), states[-1], t_eval=within, rtol=1e-8,
            atol=1e-10,
        )  # fmt: skip
        states.extend(path.y.T)
    seen = np.array(states) + rng.normal(size=(len(states), len(start))) * noise
    return Trajectory(f"log {seed}", dt * np.arange(len(seen)), seen, inputs[:, None])


def held(seed, low, high, n=40):
    return np.repeat(np.random.default_rng(seed).uniform(low, high, n), 25)


def named(found):
    return [(v.kind, v.effect) for v in found.verdicts if v.kind in ("confirmed", "ambiguous")]


@pytest.mark.long
def test_a_magnet_that_repels_far_out_is_a_force_by_position():
    def magnet(x):
        return -400 * np.tanh(6 * x) * x * x

    def rhs(x, u):
        return [x[1], u - 20 * x[0] - x[1] + magnet(x[0])]

    logs = [integrated(rhs, [0, 0], held(0, -9, 9), 0.02, [1e-3, 1e-2], 0)]
    found = find_gap(
        Cart(), logs,
        effects=("linear_spring", "cubic_spring", "constant_load", "viscous_friction", "stiffness"),
    )  # fmt: skip
    assert named(found)[0] == ("confirmed", "force_curve")
    curve = next(effect for effect in found.effects if isinstance(effect, ForceCurve))
    for field in curve.strengths():
        x, _ = curve.point_of(field)
        assert curve.at(x) == pytest.approx(magnet(x), abs=1.0)  # of forces up to 35 N
    assert found.gap.after.value < 1.3 * found.gap.noise_floor.value


@pytest.mark.long
def test_torricelli_s_outflow_is_a_rate_by_the_level():
    def rhs(x, u):
        return [0.005 * u - 0.012 * np.sqrt(max(x[0], 0))]

    logs = [integrated(rhs, [0.8], held(s, 0.8, 3.6, 30), 5.0, [0.004], s) for s in (0, 1)]
    found = find_gap(
        Tank(), logs,
        effects=("constant_load", "proportional_loss", "outflow", "actuator_gain", "sensor_scale"),
    )  # fmt: skip
    assert named(found) == [("confirmed", "state_curve")]
    (curve,) = found.effects
    assert isinstance(curve, StateCurve)
    for x in np.linspace(*curve.reach, 9)[1:-1]:
        assert curve.at(x) - 0.01 * x == pytest.approx(-0.012 * np.sqrt(x), rel=0.05)


@pytest.mark.long
def test_a_thruster_that_flattens_is_a_curve_by_command():
    def rhs(x, u):
        return [x[1], 8 * np.tanh(0.25 * u) - 20 * x[0] - x[1]]

    logs = [integrated(rhs, [0, 0], held(0, -9, 9), 0.02, [1e-3, 1e-2], 0)]
    offered = ("actuator_gain", "quadratic_actuator", "saturation", "dead_zone", "viscous_friction")
    found = find_gap(Cart(), logs, effects=offered)
    assert named(found) == [("confirmed", "symmetric_input_curve")]
    (curve,) = found.effects
    assert isinstance(curve, SymmetricInputCurve)
    for u in (2.0, 4.0, 6.0, 8.0):
        assert curve.shape(u) == pytest.approx(8 * np.tanh(0.25 * u), abs=0.15)


@pytest.mark.long
def test_where_a_law_was_left_out_its_curve_is_left_out_too():
    logs = [log(eddy_brake, 0)]
    found = find_gap(Rotor(), logs, effects=("viscous_friction", "coulomb_friction"))
    assert not any(isinstance(effect, Curve) for effect in found.effects)


@pytest.mark.long
def test_a_thruster_that_is_weaker_astern_is_a_curve_of_both_directions():
    commands, thrusts = [-9.0, -4.0, 0.0, 3.0, 6.0, 9.0], [-4.0, -3.5, 0.0, 1.5, 7.0, 8.0]
    thrust = PchipInterpolator(commands, thrusts)

    def rhs(x, u):
        return [x[1], float(thrust(u)) - 20 * x[0] - x[1]]

    logs = [integrated(rhs, [0, 0], held(s, -9, 9), 0.02, [1e-3, 1e-2], s) for s in (0, 1)]
    offered = ("actuator_gain", "quadratic_actuator", "actuator_bias", "saturation", "dead_zone")
    found = find_gap(Cart(), logs, effects=offered)
    assert named(found)[0] == ("confirmed", "input_curve")
    curve = next(effect for effect in found.effects if isinstance(effect, InputCurve))
    for u in (-8.0, -6.0, -3.0, 3.0, 6.0, 8.0):
        assert curve.shape(u) == pytest.approx(float(thrust(u)), abs=0.5)
    assert found.gap.share.value > 0.95


def test_a_curve_is_asked_for_where_a_law_of_its_kind_does_as_well_as_a_load():
    """A wheel that turns one way: a load, its first name, is dry friction there."""
    rng, runs = np.random.default_rng(751), []
    for number in range(4):
        torque, path = np.repeat(rng.uniform(-1.0, 7.0, 14), 50), [rng.uniform(0.0, 60.0)]
        for push in torque[:-1]:
            path.append(path[-1])
            for _ in range(8):
                brake = 0.1 * path[-1] + 12.0 * (path[-1] / 40) / (1 + (path[-1] / 40) ** 2)
                path[-1] += 0.0025 * (5.0 * push - brake)
        seen = np.array(path)[:, None] + rng.normal(0, 0.25, (len(torque), 1))
        times = 0.02 * np.arange(len(seen))
        runs.append(Trajectory(str(number), times, seen, torque[:-1, None]))
    slow = DampedRotor().with_parameters(damping=0.1)
    found = find_gap(slow, runs, effects=OFFERED, minutes=0.5)
    assert "friction_curve" in {verdict.effect for verdict in found.verdicts}
    assert found.gap.after.value < 3 * found.gap.noise_floor.value
