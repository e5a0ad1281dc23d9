"""Logs whose unit or sign is wrong where forecasts tell little of it: small swings, poor models."""

from __future__ import annotations

import numpy as np
import pytest

from residual.gap import find_gap
from residual.gap.preparation.conventions import otherwise
from residual.gap.preparation.prepare import prepare
from residual.trajectories import Trajectory
from sims.effects import LinearSpring, ParameterChange, ViscousFriction
from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.simulator import Channel, Parameter


class Thread(EquationOfMotion):
    """A bob that swings freely on a thread; the angle counts from hanging."""

    dt = 1 / 30
    state_channels = (
        Channel("angle", "rad", "position", angle=True),
        Channel("rate", "rad/s", "rate", rate_of="angle"),
    )
    action_channels = ()
    parameters = {"length": Parameter(0.57, "m", "of the thread", low=0.01)}

    def acceleration(self, q, v, u, force, p):
        return (force[:, 0] / p.length**2 - 9.81 / p.length * np.sin(q[:, 0]))[:, None]


class Wheel(FirstOrderSystem):
    """A driven wheel: 10 % of the command are 0.15 m/s."""

    dt = 0.1
    state_channels = (Channel("speed", "m/s", "rate", scale=0.2),)
    action_channels = (Channel("command", "1", "input", scale=10.0, low=-100.0, high=100.0),)
    parameters = {"time_constant": Parameter(0.2, "s", "of the motor", low=0.01)}

    def derivative(self, x, u, p):
        return ((0.015 * u[:, 0] - x[:, 0]) / p.time_constant)[:, None]


def swings(effects=(), factor=1.0):
    """Three runs of decaying swings by a tenth to a third of a radian; only the angle is logged."""
    rng = np.random.default_rng(0)
    simulator = Thread().with_effects(list(effects))
    runs = []
    for number, start in enumerate((0.3, 0.24, 0.2)):
        path = simulator.rollout(np.array([[start, 0.0]]), np.zeros((1, 190, 0)))[0]
        seen = np.full_like(path, np.nan)
        seen[:, 0] = factor * (path[:, 0] + 0.002 * rng.standard_normal(len(path)))
        times = simulator.dt * np.arange(len(path))
        runs.append(Trajectory(f"run {number}", times, seen, np.zeros((190, 0))))
    return runs


def asked(simulator, runs, horizon):
    return otherwise(simulator, prepare(simulator, runs, horizon).fitter)


DAMPED = (ParameterChange("length", 0.1), ViscousFriction("angle", 0.06))


def test_small_swings_in_degrees_are_asked_about():
    """They swing alike in every smaller unit, so nothing but the absurd size tells."""
    found = asked(Thread(), swings(DAMPED, factor=180 / np.pi), 0.6)
    assert found is not None
    assert any("`unit: deg` for angle" in change for change in found.changes)


@pytest.mark.parametrize("effects", [(), DAMPED, (LinearSpring("angle", 2.0),)])
def test_small_swings_in_radians_are_not(effects):
    assert asked(Thread(), swings(effects), 0.6) is None


@pytest.mark.long
def test_nothing_is_certain_of_degrees_that_pass_for_radians():
    found = find_gap(Thread(), swings(DAMPED, factor=180 / np.pi), minutes=0.5)
    assert found.conventions is not None
    assert not any(verdict.kind == "confirmed" for verdict in found.verdicts)


def records(gain):
    """Four of a wheel whose gain is so many times as large; its command changes every second."""
    rng = np.random.default_rng(1)
    runs = []
    for number in range(4):
        commands = np.repeat(rng.uniform(-20.0, 20.0, (1, 6, 1)), 10, axis=1)
        speed = Wheel().rollout(np.zeros((1, 1)), gain * commands)[0]
        speed += 0.01 * rng.standard_normal(speed.shape)
        times = Wheel.dt * np.arange(len(speed))
        runs.append(Trajectory(f"run {number}", times, speed, commands[0]))
    return runs


def test_a_sign_is_asked_about_where_it_alone_foretells_poorly():
    """The wheel runs backwards, and half as fast as it should."""
    found = asked(Wheel(), records(gain=-0.5), 1.0)
    assert found is not None
    assert "`scale: -1` for command" in found.changes


@pytest.mark.parametrize("gain", [2.3, 0.2])
def test_a_gain_is_no_sign(gain):
    found = asked(Wheel(), records(gain), 1.0)
    assert found is None or not any("-1" in change for change in found.changes)
