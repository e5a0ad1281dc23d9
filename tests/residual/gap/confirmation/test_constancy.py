"""Constants that are none: zeros that creep, and loads that differ from record to record."""

import dataclasses
from typing import ClassVar

import numpy as np
import pytest
from oven import Oven, steps

from residual.gap import find_gap
from residual.gap.confirmation.constancy import far_apart
from residual.trajectories import Trajectory
from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.simulator import Channel, Parameter
from studies.gap.answer import notes

DUTIES = [np.random.default_rng(seed).uniform(0.1, 1.0, 12) for seed in (0, 1)]
RUNS = [steps(seed, list(duties), 0.3, lag=0.0) for seed, duties in enumerate(DUTIES)]

OFFERED = ("constant_load", "sensor_offset", "actuator_gain")


def shifted(run, first, last):
    """A record whose zero goes in a straight line from one value to another, in K."""
    zero = np.linspace(first, last, len(run.times))
    return dataclasses.replace(run, states=run.states + zero[:, None])


@pytest.mark.parametrize(("zeros", "creeps"), [
    (((5, 5), (5, 5)), False),
    pytest.param(((4.8, 5.2), (4.8, 5.2)), False, marks=pytest.mark.long),
    (((3, 7), (3, 7)), True), pytest.param(((7, 3), (7, 3)), True, marks=pytest.mark.long),
    pytest.param(((7, 7), (3, 3)), True, marks=pytest.mark.long),
])  # fmt: skip
def test_a_push_is_certain_only_while_it_is_a_constant(zeros, creeps):
    runs = [shifted(run, *ends) for run, ends in zip(RUNS, zeros, strict=True)]
    (named,) = [v for v in find_gap(Oven(), runs, effects=OFFERED).verdicts if v.label]
    assert named.effect in ("constant_load", "sensor_offset")
    assert ("creeps" in named.doubts) == creeps
    assert (named.kind == "confirmed") == (not creeps)


class Body(EquationOfMotion):
    """A body on a spring and a damper, by the force on it."""

    dt = 0.02
    state_channels = (
        Channel("x", "m", "position", scale=0.1),
        Channel("v", "m/s", "rate", scale=0.5, rate_of="x"),
    )
    action_channels = (Channel("push", "N", "input", scale=10.0),)

    def acceleration(self, q, v, u, force, p):
        return u - 100.0 * q - 4.0 * v + force


def damped(seed, harder, load, n=500):
    """Pushes that become weaker and stronger; the damper is harder upwards, by Euler in 1 ms."""
    rng = np.random.default_rng(seed)
    sizes = np.resize([12.0, 3.0, 0.5, 8.0], n // 25)
    pushes = np.repeat(sizes * rng.uniform(-1, 1, n // 25), 25)
    x, v, seen = 0.0, 0.0, []
    for push in pushes:
        seen.append((x, v))
        for _ in range(20):
            damper = 4.0 * v * (1 + harder * np.sign(v))
            v += 0.001 * (push + load - 100.0 * x - damper)
            x += 0.001 * v
    states = np.array(seen) + [2e-4, 1e-3] * rng.standard_normal((len(seen), 2))
    return Trajectory(f"record {seed}", 0.02 * np.arange(len(seen)), states, pushes[:-1, None])


@pytest.mark.parametrize(("harder", "load"), [(0.5, 0.0), (0.0, 0.5)])
def test_what_pushes_only_while_it_moves_is_no_constant_push(harder, load):
    runs = [damped(seed, harder, load) for seed in (0, 1)]
    (named,) = [v for v in find_gap(Body(), runs, effects=OFFERED[:2]).verdicts if v.label]
    assert ("creeps" in named.doubts) == bool(harder)
    assert (named.kind == "confirmed") == bool(load)


class Wheel(FirstOrderSystem):
    """A wheel on a motor, by its voltage, without friction."""

    dt = 0.02
    state_channels = (Channel("speed", "rad/s", "rate", scale=20.0),)
    action_channels = (Channel("voltage", "V", "input", scale=6.0, low=-12.0, high=12.0),)
    parameters: ClassVar = {
        "k": Parameter(3.0, "rad/s/V", "speed per volt", low=0.1),
        "tau": Parameter(0.15, "s", "time constant", low=0.01),
    }

    def derivative(self, x, u, p):
        return ((p.k * u[:, 0] - x[:, 0]) / p.tau)[:, None]


def rubbed(seed, begin, end, n=600):
    """A record in which dry friction goes from one level to another, by Euler in 1 ms."""
    rng = np.random.default_rng(seed)
    volts = np.repeat(rng.uniform(-9, 9, n // 30), 30)
    speed, seen = 0.0, []
    for k in range(n):
        seen.append(speed)
        level = begin + (end - begin) * k / n
        for _ in range(20):
            pull = (3.0 * volts[k] - speed) / 0.15
            if speed == 0.0 and abs(pull) <= level:
                continue
            after = speed + 0.001 * (pull - level * np.sign(speed or pull))
            speed = 0.0 if speed * after < 0 else after
    times = 0.02 * np.arange(n)
    states = np.array(seen)[:, None] + 0.15 * rng.standard_normal((n, 1))
    return Trajectory(f"record {seed}", times, states, volts[:-1, None])


@pytest.mark.parametrize(
    ("begin", "end"), [pytest.param(40.0, 14.0, marks=pytest.mark.long), (25.0, 25.0)]
)
def test_friction_that_falls_as_it_warms_is_told_with_where_it_begins_and_ends(begin, end):
    asked = ("coulomb_friction", "viscous_friction", "actuator_gain")
    found = find_gap(Wheel(), [rubbed(seed, begin, end) for seed in (0, 1)], effects=asked)
    (friction,) = [v for v in found.verdicts if v.effect == "coulomb_friction"]
    (level,) = friction.parameters.values()
    if begin == end:
        assert friction.kind == "confirmed" and level.along is None
        assert level.low < begin < level.high and level.high - level.low < 6.0
    else:
        assert level.along == pytest.approx((begin, end), abs=6.0)
        assert level.low < end + 6.0 and level.high > begin - 6.0
        assert any("no constant: about" in line for line in notes(friction, found))


class Servo(FirstOrderSystem):
    """It follows its command; that its speed has a limit nobody knows."""

    dt = 0.02
    state_channels = (Channel("angle", "deg", "other", scale=90.0),)
    action_channels = (Channel("command", "deg", "input", scale=90.0, low=-180.0, high=180.0),)
    parameters: ClassVar = {"slow": Parameter(0.08, "s", "time constant", low=0.005)}

    def derivative(self, x, u, p):
        return ((u[:, 0] - x[:, 0]) / p.slow)[:, None]


def limited(seed, largest, smallest, n=900):
    """Steps that become smaller, or stay as large, of a servo that turns 250 deg/s at most."""
    rng = np.random.default_rng(seed)
    sizes = np.linspace(largest, smallest, n // 45)
    goals = np.repeat(np.cumsum(sizes * np.resize([1, -1], len(sizes))) / 2, 45)
    angle, seen = 0.0, []
    for goal in goals:
        seen.append(angle)
        for _ in range(20):
            angle += 0.001 * np.clip((goal - angle) / 0.08, -250.0, 250.0)
    states = np.array(seen)[:, None] + 0.1 * rng.standard_normal((len(seen), 1))
    return Trajectory(f"record {seed}", 0.02 * np.arange(len(seen)), states, goals[:-1, None])


@pytest.mark.long
def test_a_lag_that_is_many_times_as_long_where_steps_are_large_is_not_certain():
    runs = [limited(seed, 150.0, 10.0) for seed in (0, 1)]
    found = find_gap(Servo(), runs, effects=["actuator_lag", "constant_load"], hold="zero")
    (lag,) = [v for v in found.verdicts if v.effect == "actuator_lag"]
    (time,) = lag.parameters.values()
    assert lag.kind == "ambiguous" and "unsteady" in lag.doubts
    assert time.along[0] > 3 * abs(time.along[1])


@pytest.mark.parametrize(("ends", "apart"), [
    ((40.0, 14.0), False), ((-0.2, -0.5), False), ((0.59, 0.13), True), ((0.0, 2.4), True),
    ((0.3, -0.2), True), ((-4.0, -1.0), True),
])  # fmt: skip
def test_sizes_of_one_effect_are_within_three_times(ends, apart):
    assert far_apart(ends) == far_apart(ends[::-1]) == apart
