"""A servo that sticks, breaks away and hunts: where its friction is sought, and what is named."""

from __future__ import annotations

import functools
from typing import ClassVar

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from swing import sticking

from residual.gap.candidates import candidates
from residual.gap.find import find_gap
from residual.gap.global_search import _Space
from residual.gap.model import Model
from residual.gap.samples import Samples
from residual.trajectories import Trajectory
from sims.effects import ActuatorGain, StribeckFriction
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter


class Servo(EquationOfMotion):
    dt = 0.02
    state_channels = (
        Channel("angle", "rad", "position", scale=3.0),
        Channel("rate", "rad/s", "rate", rate_of="angle", scale=10.0),
    )
    action_channels = (Channel("pwm", "1", "input", scale=100.0, low=-255.0, high=255.0),)
    parameters: ClassVar = {
        "gain": Parameter(0.2, "rad/s", "speed of a count"),
        "time_constant": Parameter(0.15, "s", "time constant"),
        "inertia": Parameter(1e-3, "kg m^2", "inertia"),
    }

    def acceleration(self, q, v, u, force, p):
        driven = (p.gain * u[:, 0] - v[:, 0]) / p.time_constant
        return (driven + force[:, 0] / p.inertia)[:, None]


@functools.cache
def hunting(breakaway: float = 110.0, seed: int = 1) -> Trajectory:
    """Friction of 0.168 N m, at rest 2.8e-3 times ``breakaway``; 2.1 times the nominal drive."""
    angle, volts = sticking(breakaway, 120.0, seed)
    states = np.stack([angle, np.full(len(angle), np.nan)], axis=1)
    return Trajectory("hunting", 0.02 * np.arange(len(angle)), states, volts[:-1, None])


@given(
    sliding=st.floats(1e-3, 0.1), times=st.floats(1.01, 4.0),
    speed=st.floats(0.1, 50), gain=st.floats(-0.5, 2.0),
)  # fmt: skip
@settings(max_examples=50, deadline=None)
def test_friction_is_sought_where_it_breaks_away_harder_than_it_slides(sliding, times, speed, gain):
    servo = Servo()
    samples = Samples.join([hunting()], 20)
    found = candidates(servo, (StribeckFriction("angle"), ActuatorGain("pwm")), samples)
    theta = np.array([sliding, sliding * times, speed, gain])
    space = _Space(Model(servo, found), theta, 4)
    np.testing.assert_allclose(space.numbers(space.point(theta)[None])[0], theta, rtol=1e-4)
    corners = space.numbers(np.stack([space.low, space.high]))
    assert (corners[:, 1] >= corners[:, 0]).all()


@pytest.mark.long
@pytest.mark.parametrize(
    ("breakaway", "seed"),
    [
        (110.0, 1),
        (90.0, 2),
        pytest.param(
            110.0, 5, marks=pytest.mark.xfail(strict=True, reason="a dead zone is certain")
        ),
    ],
)
def test_of_a_servo_that_hunts_nothing_wrong_is_certain(breakaway, seed):
    found = find_gap(Servo(), [hunting(breakaway, seed)])
    certain = {v.effect: v for v in found.verdicts if v.kind == "confirmed"}
    assert set(certain) <= {"stribeck_friction", "coulomb_friction", "actuator_gain", "gain"}
    if "stribeck_friction" in certain:
        told = certain["stribeck_friction"].parameters["breakaway"].value
        assert told == pytest.approx(2.8e-3 * breakaway, rel=0.05)
