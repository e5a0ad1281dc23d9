"""Encoders that err per turn: geometry, the derivative of what they read, and its inverse."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sims.effects import EncoderError
from sims.effects.library import further_in
from sims.equations import EquationOfMotion
from sims.simulator import Channel

SIZES = st.floats(-0.06, 0.06)


class Wheel(EquationOfMotion):
    dt = 0.01
    state_channels = (
        Channel("speed", "rad/s", "rate", rate_of="angle", scale=10.0),
        Channel("angle", "rad", "position"),
    )
    action_channels = (Channel("torque", "N m", "input"),)

    def acceleration(self, q, v, u, force, p):
        return 2.0 * (u + force)


class InDegrees(Wheel):
    state_channels = (
        Channel("speed", "deg/s", "rate", rate_of="angle", scale=500.0),
        Channel("angle", "deg", "position"),
    )


@given(st.tuples(*6 * [SIZES]), st.floats(-50, 50), st.floats(-20, 20))
def test_what_is_true_is_found_from_what_is_read(sizes, angle, speed):
    wheel = Wheel(effects=[EncoderError("angle", *sizes)])
    read = wheel.sense(np.array([[speed, angle]]))
    assert wheel.unsense(read)[0] == pytest.approx([speed, angle], rel=1e-9, abs=1e-9)


@given(st.tuples(*6 * [SIZES]), st.floats(-5, 5), st.floats(-20, 20))
def test_the_rate_is_that_of_the_angle_that_is_read(sizes, angle, speed):
    wheel, short = Wheel(effects=[EncoderError("angle", *sizes)]), 1e-6
    places = angle + speed * np.array([-short, 0.0, short])
    read = wheel.sense(np.column_stack([np.full(3, speed), places]))
    assert read[1, 0] == pytest.approx((read[2, 1] - read[0, 1]) / (2 * short), abs=1e-6)


def test_a_disc_off_its_axis_errs_by_its_share_of_the_radius():
    # The reading head sits at 1 on the axis of x; the middle of the disc is 0.01 off the axis.
    share, phase = 0.01, 0.7
    angles = np.linspace(0, math.tau, 50)
    middle = share * np.stack([np.cos(angles + phase), np.sin(angles + phase)])
    line = np.arctan2(-middle[1], 1 - middle[0])  # under which the middle sees the head
    read = EncoderError("angle", share * math.cos(phase), share * math.sin(phase)).read(angles)
    assert read == pytest.approx(angles - line, abs=share**2)


def test_a_universal_joint_errs_twice_per_turn():
    bend, angles = 0.2, np.linspace(-3, 3, 50)
    turned = np.unwrap(np.arctan2(np.sin(angles), np.cos(bend) * np.cos(angles)))
    read = EncoderError("angle", sine_2=math.tan(bend / 2) ** 2).read(angles)
    assert read == pytest.approx(turned, abs=bend**4 / 16)


def test_a_degree_is_no_radian():
    states = np.array([[3.0, 1.0], [-2.0, 7.0]])
    effect = EncoderError("angle", 0.05, -0.02, 0.03, 0.01, -0.02, 0.01)
    turned = InDegrees(effects=[effect]).sense(np.degrees(states))
    assert np.radians(turned) == pytest.approx(Wheel(effects=[effect]).sense(states), rel=1e-12)


def test_it_is_a_rarer_effect_of_angles():
    found = [effect for effect in further_in(Wheel()) if isinstance(effect, EncoderError)]
    assert list(map(str, found)) == ["encoder_error@angle"]
    assert found[0].quantities(Wheel())["sine_1"].unit == "rad"
    with pytest.raises(ValueError, match="needs an angle; 'speed' is none"):
        Wheel(effects=[EncoderError("speed", 0.1)])
