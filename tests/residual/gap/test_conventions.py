"""Logs that count signs and zeros otherwise than the simulator."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from residual.gap.conventions import otherwise
from residual.gap.prepare import prepare
from residual.trajectories import Trajectory
from sims.effects import ActuatorGain, CoulombFriction, LinearSpring
from sims.pendulum_equation import PendulumEquation

LARGE = [
    (), (CoulombFriction("pivot", 0.01),), (LinearSpring("pivot", 0.01, np.pi),),
    (ActuatorGain("voltage", 1.0),), (ActuatorGain("voltage", -0.8),),
]  # fmt: skip


def log(effects=(), seed=0, dt=0.02):
    """A pendulum swinging about its lowest point, driven either way."""
    rng = np.random.default_rng(seed)
    simulator = PendulumEquation(dt=dt)
    volts = np.repeat(rng.uniform(-2.0, 2.0, (1, 40, 1)), 20, axis=1)
    states = simulator.with_effects(list(effects)).rollout(np.array([[np.pi + 0.3, 0.0]]), volts)[0]
    states += np.array([0.003, 0.03]) * rng.standard_normal(states.shape)
    return Trajectory("run", dt * np.arange(len(states)), states, volts[0])


def told(run):
    simulator = PendulumEquation(dt=0.02)
    return otherwise(simulator, prepare(simulator, [run], 0.5).fitter)


@pytest.mark.parametrize("effects", LARGE)
def test_a_large_gap_is_no_matter_of_convention(effects):
    assert not told(log(effects))


@pytest.mark.parametrize("effects", [(), (CoulombFriction("pivot", 0.003),)])
def test_a_reversed_input_is_told(effects):
    run = log(effects)
    (says,) = told(dataclasses.replace(run, actions=-run.actions))
    assert "scale: -1 for voltage" in says


@pytest.mark.parametrize(("offset", "wanted"), [
    (np.pi, "3.14159"), (-np.pi / 2, "1.5708"), (np.pi / 2, "-1.5708"),
])  # fmt: skip
def test_an_angle_counted_from_elsewhere_is_told(offset, wanted):
    run = log()
    (says,) = told(dataclasses.replace(run, states=run.states + np.array([offset, 0.0])))
    assert f"offset: {wanted} for angle" in says


def test_a_joint_that_counts_the_other_way_round_is_told():
    """Only the gravity of a sideways zero tells it from a reversed input."""
    run = log()
    turned = dataclasses.replace(run, states=np.array([-1.0, -1.0]) * run.states)
    (says,) = told(turned)
    assert "scale: -1 for angle and rate" in says
