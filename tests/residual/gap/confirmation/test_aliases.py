"""Which of several effects that move alike is looked for, and what is found by it."""

from typing import ClassVar

import numpy as np
import pytest

from residual.gap import find_gap
from residual.gap.confirmation.aliases import (
    aliases,
    beyond_parameters,
    representatives,
)
from residual.trajectories import Trajectory
from sims.effects.library import library
from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.simulator import Channel, Parameter


class Wheel(FirstOrderSystem):
    """A driven wheel that its bearing brakes."""

    dt = 0.1
    state_channels = (Channel("speed", "rad/s", "rate", scale=10.0),)
    action_channels = (Channel("drive", "V", "input", scale=5.0, low=-12.0, high=12.0),)
    parameters = {
        "gain": Parameter(4.0, "rad/s^2/V", "acceleration per volt", low=0.01),
        "damping": Parameter(1.0, "1/s", "damping of the bearing", low=0.0),
    }

    def derivative(self, x, u, p):
        return (p.gain * u[:, 0] - p.damping * x[:, 0])[:, None]


class Tank(FirstOrderSystem):
    """A tank that a pump fills."""

    dt = 2.0
    state_channels = (Channel("level", "cm", "other", scale=20.0),)
    action_channels = (Channel("pump", "V", "input", scale=5.0, low=0.0, high=12.0),)
    parameters = {"gain": Parameter(0.4, "cm/s/V", "inflow", low=0.01)}

    def derivative(self, x, u, p):
        return (p.gain * u[:, 0])[:, None]


def logs(system, exact, low):
    """Four records with noise, by the closed form of one control period, ``exact(x, u)``."""
    found = []
    for seed in range(4):
        rng = np.random.default_rng(seed)
        inputs = np.repeat(rng.uniform(low, 10.0, 30), 10)
        states = [0.0]
        for u in inputs:
            states.append(exact(states[-1], u))
        seen = np.array(states) + 0.05 * rng.standard_normal(len(states))
        times = system.dt * np.arange(len(states))
        found.append(Trajectory(f"run {seed}", times, seen[:, None], inputs[:, None]))
    return found


def relaxing(gain, rate, dt):
    return lambda x, u: gain * u / rate + (x - gain * u / rate) * np.exp(-rate * dt)


def test_too_much_of_a_parameter_is_asked_for_beside_a_twin_that_cannot_be_negative():
    wheel = Wheel()
    offered = library(wheel)
    groups, _ = aliases(wheel, offered)
    kept, less = representatives(wheel, offered, groups)
    names = [str(effect) for effect in kept]
    assert "viscous_friction@speed" in names and "damping" not in names
    assert [(str(effect), sign) for effect, sign in less] == [("damping", -1.0)]


class Rotor(EquationOfMotion):
    """What spins down without a drive: of inertia and damping only the ratio shows."""

    dt = 0.01
    state_channels = (
        Channel("angle", "rad", "position", angle=True),
        Channel("speed", "rad/s", "rate", rate_of="angle", scale=500.0),
    )
    action_channels = ()
    parameters: ClassVar = {
        "inertia": Parameter(5e-6, "kg m^2", "rotor and wheel", low=1e-8),
        "damping": Parameter(2.5e-5, "N m s/rad", "bearings", low=0.0),
    }

    def acceleration(self, q, v, u, force, p):
        return ((force[:, 0] - p.damping * v[:, 0]) / p.inertia)[:, None]


class Flywheel(Rotor):
    """The same with damping that is taken for exact."""

    parameters: ClassVar = {"inertia": Rotor.parameters["inertia"]}

    def acceleration(self, q, v, u, force, p):
        return ((force[:, 0] - 2.5e-5 * v[:, 0]) / p.inertia)[:, None]


@pytest.mark.parametrize(("system", "away"), [
    (Rotor, ("damping", -1.0)), (Flywheel, ("inertia", 1.0)),
])  # fmt: skip
def test_of_parameters_that_act_alike_the_one_and_the_sign_that_brake_less_are_asked(system, away):
    groups, _ = aliases(system(), library(system()))
    _, less = representatives(system(), library(system()), groups)
    assert [(str(effect), sign) for effect, sign in less] == [away]


def spun_down(noise, rows, seed):
    """A quick and a slow run of a rotor, closed form, its angle read each millisecond."""
    rotor, rng = Rotor(dt=0.001), np.random.default_rng(seed)
    rate, dry = 1.1e-5 / 5e-6, 0.011 / 5e-6
    runs = []
    for begin in (1050.0, 181.0):
        times = rotor.dt * np.arange(rows)
        ends = begin + dry / rate
        angle = ends / rate * (1 - np.exp(-rate * times)) - dry / rate * times
        moves = ends * np.exp(-rate * times) > dry / rate
        seen = angle + noise * rng.standard_normal(rows)
        states = np.stack([seen, np.full(rows, np.nan)], axis=1)[moves]
        still = np.zeros((len(states) - 1, 0))
        runs.append(Trajectory(f"from {begin}", times[moves], states, still))
    return rotor, runs


@pytest.mark.parametrize(
    ("noise", "rows", "seed"), [(0.005, 110, 2), pytest.param(0.02, 90, 1, marks=pytest.mark.long)]
)
def test_too_much_damping_is_found_beside_friction_that_is_missing(noise, rows, seed):
    """Each of the two alone makes nothing better: at high speed the one makes up for the other.

    Under more noise a law whose friction falls with the speed comes first, and is taken apart.
    """
    found = {v.label: v for v in find_gap(*spun_down(noise, rows, seed)).verdicts if v.effect}
    # Of what only spins forwards no motion tells dry friction from a load.
    (dry,) = [v for name, v in found.items() if name != "damping"]
    assert "coulomb_friction@angle" in {dry.label, *dry.alternatives}
    (level,) = dry.parameters.values()
    assert abs(level.value) == pytest.approx(0.011, rel=0.15)
    assert found["damping"].parameters["change"].value == pytest.approx(-1.4e-5, rel=0.2)


@pytest.mark.parametrize(("damping", "label"), [
    (0.5, "damping"), pytest.param(1.6, "viscous_friction@speed", marks=pytest.mark.long),
])  # fmt: skip
def test_damping_that_is_too_large_is_found_as_one_that_is_too_small(damping, label):
    result = find_gap(Wheel(), logs(Wheel(), relaxing(4.0, damping, 0.1), -10.0))
    (verdict,) = [v for v in result.verdicts if v.effect]
    assert (verdict.kind, verdict.label) == ("confirmed", label)
    (change,) = verdict.parameters.values()
    assert change.value == pytest.approx(damping - 1.0, abs=0.01)
    assert {"viscous_friction@speed", "damping"} - {label} <= set(verdict.same_motion)


@pytest.mark.long
def test_a_leak_is_a_loss_in_proportion():
    result = find_gap(Tank(), logs(Tank(), relaxing(0.4, 0.05, 2.0), 0.0))
    (verdict,) = [v for v in result.verdicts if v.effect]
    assert (verdict.kind, verdict.label) == ("confirmed", "proportional_loss@level")
    assert verdict.parameters["rate"].value == pytest.approx(0.05, rel=0.01)


class Oven(FirstOrderSystem):
    """Heated, and cooled by the room."""

    dt = 2.0
    state_channels = (Channel("temperature", "K", "other", scale=300.0),)
    action_channels = (Channel("power", "W", "input", scale=10.0, low=0.0, high=20.0),)
    parameters = {
        "gain": Parameter(3.0, "K/W", "heating", low=0.01),
        "time_constant": Parameter(60.0, "s", "time constant", low=1.0),
        "room": Parameter(295.0, "K", "temperature of the room"),
    }

    def derivative(self, x, u, p):
        return ((p.room + p.gain * u[:, 0] - x[:, 0]) / p.time_constant)[:, None]


def test_a_loss_that_parameters_make_is_no_law_of_its_own():
    for system, there in ((Oven(), False), (Tank(), True)):
        names = {effect.name for effect in beyond_parameters(system, library(system))}
        assert ("proportional_loss" in names) is there
