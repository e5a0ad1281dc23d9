"""A parameter with the wrong sign in the simulator is named, and asked after, not imitated."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest

from residual.gap import find_gap
from residual.gap.answer.doubts import DOUBTS
from residual.trajectories import Trajectory
from sims.effects import LinearSpring
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter


class Gimbal(EquationOfMotion):
    """A camera on a motor, its weight beside the axis."""

    dt = 0.01
    state_channels = (
        Channel("angle", "rad", "position", scale=0.5),
        Channel("rate", "rad/s", "rate", rate_of="angle", scale=2.0),
    )
    action_channels = (Channel("torque", "N m", "input", scale=0.2),)
    parameters: ClassVar = {
        "inertia": Parameter(0.005, "kg m^2", "about the axis", low=1e-5),
        "unbalance": Parameter(0.05, "N m", "weight times distance"),
        "damping": Parameter(0.01, "N m s/rad", "of the bearing", low=0.0),
    }

    def acceleration(self, q, v, u, force, p):
        total = u[:, 0] - p.unbalance * np.sin(q[:, 0]) - p.damping * v[:, 0] + force[:, 0]
        return (total / p.inertia)[:, None]


def test_a_sign_that_is_wrong_beside_a_spring_that_is_missing():
    true = Gimbal().with_parameters(unbalance=-0.05)
    true = true.with_effects([LinearSpring("angle", 0.15, 0.3)])
    runs = []
    for seed in range(3):
        rng = np.random.default_rng(seed)
        torque = np.repeat(rng.uniform(-0.1, 0.1, 20), 40)[:, None]
        states = true.rollout([0.2, 0.0], torque)
        states += np.array([5e-4, 0.01]) * rng.standard_normal(states.shape)
        runs.append(Trajectory(f"run {seed}", 0.01 * np.arange(len(states)), states, torque))
    offered = ("linear_spring", "constant_load", "inertia", "unbalance", "damping")
    found = find_gap(Gimbal(), runs, effects=offered)
    named = {v.effect: v for v in found.verdicts if v.kind in ("confirmed", "ambiguous")}
    assert set(named) == {"linear_spring", "unbalance"}
    turned = named["unbalance"]
    assert turned.parameters["change"].value == pytest.approx(-0.1, rel=0.03)
    assert named["linear_spring"].parameters["stiffness"].value == pytest.approx(0.15, rel=0.03)
    # Right as it is, somebody has to look at the sign first.
    assert all(v.kind == "ambiguous" and "extreme" in v.doubts for v in named.values())
    assert "the other way" in DOUBTS["extreme"]
