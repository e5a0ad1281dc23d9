"""Ends of a joint's way: against SciPy, and where they are looked for."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from sims.effects import LowerStop, UpperStop, library
from sims.effects.library import further_in
from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.simulator import Channel

MASS, DAMPING, STIFF, SOFT = 2.0, 6.0, 4000.0, 20.0


class Cart(EquationOfMotion):
    dt, substeps = 0.01, 40
    state_channels = (
        Channel("place", "m", "position", scale=0.2),
        Channel("speed", "m/s", "rate", rate_of="place", scale=0.5),
    )
    action_channels = (Channel("push", "N", "input", scale=8.0),)

    def acceleration(self, q, v, u, force, p):
        return (u + force - DAMPING * v) / MASS


def test_a_cart_between_two_bumpers_moves_as_scipy_says():
    pushes = np.repeat([8.0, -8.0, 5.0, -3.0], 50)
    bumpers = [UpperStop("place", STIFF, SOFT, 0.2), LowerStop("place", STIFF, SOFT, -0.1)]
    path = Cart(effects=bumpers).rollout(np.zeros(2), pushes[:, None])

    def rates(_, x, push):
        upper = max(STIFF * (x[0] - 0.2) + SOFT * x[1], 0.0) if x[0] > 0.2 else 0.0
        lower = max(STIFF * (-0.1 - x[0]) - SOFT * x[1], 0.0) if x[0] < -0.1 else 0.0
        return [x[1], (push - DAMPING * x[1] - upper + lower) / MASS]

    x = np.zeros(2)
    for k, push in enumerate(pushes):
        x = solve_ivp(rates, (0, 0.01), x, rtol=1e-9, atol=1e-11, args=(push,), max_step=5e-4).y[
            :, -1
        ]
        assert path[k + 1] == pytest.approx(x, abs=5e-3)
    assert 0.2 < path[:, 0].max() < 0.22 and -0.12 < path[:, 0].min() < -0.1


@given(st.floats(-1, 1), st.floats(-10, 10), st.floats(0, 1e4), st.floats(0, 1e3))
def test_a_stop_pushes_back_and_never_pulls(place, speed, stiffness, damping):
    upper = UpperStop("place", stiffness, damping, 0.3).force(place, speed)
    lower = LowerStop("place", stiffness, damping, -0.3).force(-place, -speed)
    assert upper <= 0 and lower == -upper
    assert upper == 0 or place > 0.3


class Tank(FirstOrderSystem):
    state_channels = (Channel("level", "m", "other"),)
    action_channels = (Channel("pump", "V", "input"),)

    def derivative(self, x, u, p):
        return u - x


class Wheel(FirstOrderSystem):
    state_channels = (Channel("speed", "rad/s", "rate"),)
    action_channels = (Channel("torque", "N m", "input"),)

    def derivative(self, x, u, p):
        return u - x


def test_they_are_rarer_effects_of_what_moves():
    found = set(map(str, further_in(Cart())))
    assert {"upper_stop@place", "lower_stop@place"} <= found
    known = UpperStop("place").quantities(Cart())
    assert {name: one.unit for name, one in known.items()} == {
        "stiffness": "N/m", "damping": "N s/m", "at": "m"
    }  # fmt: skip
    for other in (Tank(), Wheel()):
        for effect in (*library(other), *further_in(other)):
            assert not isinstance(effect, UpperStop | LowerStop)
