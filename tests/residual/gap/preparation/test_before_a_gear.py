"""Torques of motors, logged in place of those of the joints behind their gears."""

from typing import ClassVar

import numpy as np
import pytest

from residual.gap.preparation.conventions import otherwise
from residual.gap.preparation.prepare import prepare
from residual.trajectories import Trajectory
from sims import Channel, EquationOfMotion, Parameter
from sims.effects import ActuatorGain, CoulombFriction


class Link(EquationOfMotion):
    """A rod that hangs, driven by a geared motor."""

    dt = 0.02
    state_channels = (
        Channel("angle", "rad", "position"),
        Channel("rate", "rad/s", "rate", rate_of="angle", scale=3.0),
    )
    action_channels = (Channel("torque", "N m", "input", scale=10.0),)
    parameters: ClassVar = {"inertia": Parameter(0.4, "kg m^2", "of the rod", low=0.01)}

    def acceleration(self, q, v, u, force, p):
        return (u + force - 8.0 * np.sin(q) - 0.3 * v) / np.reshape(p.inertia, (-1, 1))


def told(ratio, effects=()):
    """What is told of a log whose torques are a ratio too small."""
    rng = np.random.default_rng(3)
    torque = np.repeat(rng.uniform(-12, 12, (1, 40, 1)), 15, axis=1)
    path = Link(effects=effects).rollout(np.zeros((1, 2)), torque)[0]
    path += rng.normal(0, 0.002, path.shape)
    run = Trajectory("link", 0.02 * np.arange(len(path)), path, torque[0] / ratio)
    found = otherwise(Link(), prepare(Link(), [run], 0.5).fitter)
    return () if found is None else found.changes


@pytest.mark.parametrize("ratio", [15.0, pytest.param(50.0, marks=pytest.mark.long), 160.0])
def test_the_ratio_of_a_gear_is_told_about(ratio):
    (first, *_) = told(ratio, [CoulombFriction("angle", 0.5)])
    assert "before a gear" in first
    about = float(first.split("scale: ")[1].split("`")[0])
    assert about == pytest.approx(ratio, rel=0.35)


@pytest.mark.parametrize("effect", [ActuatorGain("torque", -0.4), CoulombFriction("angle", 2.0)])
def test_what_is_weaker_than_said_is_no_gear(effect):
    assert not told(1.0, [effect])
