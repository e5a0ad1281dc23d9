"""Angles of a chain that a log counts from outside, and the simulator from the joint before."""

import numpy as np
import pytest

from residual.gap.preparation.conventions import otherwise
from residual.gap.preparation.prepare import prepare
from residual.trajectories import Trajectory
from sims import Channel, EquationOfMotion, Parameter
from sims.effects import ParameterChange


class Chain(EquationOfMotion):
    """Two rods, the second one hung on the first, which is so heavy that it feels nothing of it;
    the second angle is counted from the first rod."""

    dt = 0.02
    state_channels = (
        Channel("hip", "rad", "position"),
        Channel("knee", "rad", "position"),
        Channel("hip rate", "rad/s", "rate", rate_of="hip", scale=3.0),
        Channel("knee rate", "rad/s", "rate", rate_of="knee", scale=3.0),
    )
    action_channels = (
        Channel("thigh", "rad/s^2", "input", scale=10.0),
        Channel("shank", "rad/s^2", "input", scale=10.0),
    )
    parameters = {"swing": Parameter(20.0, "1/s^2", "gravity over length", low=1.0)}

    def acceleration(self, q, v, u, force, p):
        hip = -0.5 * p.swing * np.sin(q[:, 0]) + u[:, 0]
        knee = -p.swing * np.sin(q[:, 0] + q[:, 1]) + u[:, 1] - hip
        return np.stack([hip, knee], axis=1)


def counted(times, effects=()):
    """What is told of a log whose knee is counted with so many times the hip's angle added."""
    rng = np.random.default_rng(3)
    inputs = np.repeat(rng.uniform(-12, 12, (1, 30, 2)), 15, axis=1)
    path = Chain(effects=effects).rollout(np.zeros((1, 4)), inputs)[0]
    path += rng.normal(0, 0.002, path.shape)
    path[:, [1, 3]] += times * path[:, [0, 2]]
    run = Trajectory("chain", 0.02 * np.arange(len(path)), path, inputs[0])
    found = otherwise(Chain(), prepare(Chain(), [run], 0.5).fitter)
    return () if found is None else found.changes


@pytest.mark.parametrize(
    ("times", "effects", "word"),
    [(1.0, (), "less"), (1.0, (ParameterChange("swing", 2.0),), "less"), (-1.0, (), "plus")],
)
def test_the_knee_counted_otherwise_is_told(times, effects, word):
    says = f"knee {word} hip in place of knee (rates likewise)"
    assert counted(times, effects) == (says,)


@pytest.mark.parametrize("change", [0.0, -15.0, pytest.param(15.0, marks=pytest.mark.long)])
def test_a_knee_that_counts_as_is_said_stays(change):
    assert not counted(0.0, (ParameterChange("swing", change),))
