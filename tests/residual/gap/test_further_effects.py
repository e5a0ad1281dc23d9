"""Friction load_dependent_friction is named, and asked for only where it may be."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest
from held import path

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.simulator import Channel, Parameter

MASS, DRAG, STOPS = 2.0, 3.0, 1e-3


class Slide(EquationOfMotion):
    """A slide on a screw."""

    dt = 0.02
    substeps = 4
    state_channels = (
        Channel("place", "m", "position", scale=1.0),
        Channel("speed", "m/s", "rate", rate_of="place", scale=2.0),
    )
    action_channels = (Channel("force", "N", "input", scale=20.0, low=-40.0, high=40.0),)
    parameters: ClassVar = {
        "mass": Parameter(MASS, "kg", "of the slide", low=0.01),
        "drag": Parameter(DRAG, "N s/m", "of its grease", low=0.0),
    }

    def acceleration(self, q, v, u, force, p):
        return ((u[:, 0] - p.drag * v[:, 0] + force[:, 0]) / p.mass)[:, None]


def slides(share, level, rows=240, count=3):
    """Runs of a slide with friction of a share of the force and of a level, softened at rest."""
    rng = np.random.default_rng(0)

    def rates(_, x, u):
        brake = (share * abs(u) + level) * np.tanh(x[1] / STOPS)
        return [x[1], (u - DRAG * x[1] - brake) / MASS]

    for number in range(count):
        size = np.repeat(rng.uniform(1, 10 * (1 + number), rows // 15), 15)
        force = size * np.repeat(rng.choice([-1, 1], rows // 15), 15)
        true = path(rates, [0.0, 0.0], force[:-1], 0.02, method="LSODA")
        states = true + rng.normal(0, [5e-4, 5e-3], true.shape)
        yield Trajectory(f"run {number}", 0.02 * np.arange(rows), states, force[:-1, None])


@pytest.mark.long
def test_a_screw_that_wastes_a_share_of_what_it_carries_is_named():
    result = find_gap(Slide(), list(slides(0.25, 0.0)))
    (sure,) = (v for v in result.verdicts if v.kind == "confirmed")
    assert (sure.effect, sure.where) == ("load_dependent_friction", "place")
    share = sure.parameters["share"]
    assert share.low <= 0.25 <= share.high and share.value == pytest.approx(0.25, abs=0.03)


def test_friction_of_constant_size_is_not_taken_for_it():
    told: list[str] = []
    result = find_gap(Slide(), list(slides(0.0, 2.0)), progress=told.append)
    (sure,) = (v for v in result.verdicts if v.kind == "confirmed")
    assert (sure.effect, sure.where) == ("coulomb_friction", "place")
    assert not any("load dependent friction" in line for line in told)


class Coasting(FirstOrderSystem):
    """The speed of a motor; the driver lets it coast, which the simulator does not know."""

    dt = 0.05
    state_channels = (Channel("speed", "rad/s", "rate", scale=50.0),)
    action_channels = (Channel("duty", "1", "input", scale=1.0, low=-1.0, high=1.0),)
    parameters: ClassVar = {
        "gain": Parameter(100.0, "rad/s", "speed at full duty", low=1.0),
        "tau": Parameter(0.3, "s", "time constant", low=0.01),
    }

    def derivative(self, x, u, p):
        return (np.reshape(p.gain, (-1, 1)) * u - x) / np.reshape(p.tau, (-1, 1))


@pytest.mark.long
def test_a_motor_that_coasts_is_named_by_how_much_slower_it_does_so():
    rng, runs = np.random.default_rng(0), []
    for number in range(2):
        duty = np.repeat(rng.uniform(0, 1, 30), 12)
        speed = [0.0]
        for u in duty[:-1]:  # exact: within a held input it goes one way
            tau = 0.3 if 100 * u > speed[-1] else 0.6
            speed.append(100 * u + (speed[-1] - 100 * u) * np.exp(-0.05 / tau))
        states = np.round(speed, 0)[:, None] + rng.normal(0, 0.2, (len(speed), 1))
        runs.append(
            Trajectory(f"run {number}", 0.05 * np.arange(len(duty)), states, duty[:-1, None])
        )
    result = find_gap(Coasting(), runs)
    sure = [v for v in result.verdicts if v.kind == "confirmed"]
    assert [(v.effect, v.where) for v in sure] == [("asymmetric_response", "speed")]
    back = sure[0].parameters["back"]
    assert back.low <= -0.5 <= back.high and back.value == pytest.approx(-0.5, abs=0.05)


class Boat(FirstOrderSystem):
    """The speed of a boat, whose screw is weaker in reverse, which the simulator does not know."""

    dt = 0.1
    state_channels = (Channel("speed", "m/s", "rate", scale=1.0),)
    action_channels = (Channel("thrust", "N", "input", scale=20.0, low=-50.0, high=50.0),)
    parameters: ClassVar = {
        "mass": Parameter(15.0, "kg", "of the boat and some water", low=1.0),
        "drag": Parameter(6.0, "N s/m", "of the hull", low=0.0),
    }

    def derivative(self, x, u, p):
        return (u - np.reshape(p.drag, (-1, 1)) * x) / np.reshape(p.mass, (-1, 1))


@pytest.mark.long
def test_a_screw_that_is_weaker_in_reverse_is_named():
    rng, runs = np.random.default_rng(0), []
    for number in range(2):
        thrust = np.repeat(rng.uniform(-40, 40, 30), 12)
        speed = [0.0]
        for u in np.where(thrust < 0, 0.7 * thrust, thrust)[:-1]:
            speed.append(u / 6 + (speed[-1] - u / 6) * np.exp(-0.1 * 6 / 15))
        states = np.array(speed)[:, None] + rng.normal(0, 0.02, (len(speed), 1))
        runs.append(
            Trajectory(f"run {number}", 0.1 * np.arange(len(thrust)), states, thrust[:-1, None])
        )
    sure = [v for v in find_gap(Boat(), runs).verdicts if v.kind == "confirmed"]
    assert [(v.effect, v.where) for v in sure] == [("asymmetric_actuator", "thrust")]
    backward = sure[0].parameters["backward"]
    assert backward.low <= -0.3 <= backward.high
    assert backward.value == pytest.approx(-0.3, abs=0.05)
    told: list[str] = []
    find_gap(Boat(), runs, measured_input=True, progress=told.append)
    assert not any("asymmetric actuator" in line for line in told)  # what was measured is there
