"""What hardly shows over a part of a swing, and takes half of the motion over the whole record."""

from typing import ClassVar

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter

MASS, ARM, INERTIA = 0.057, 0.052, 1.87e-4


class Hung(EquationOfMotion):
    """A body that hangs by an arm and swings; only how fast is measured."""

    dt = 0.02
    state_channels = (
        Channel("yaw", "rad", "position", angle=True),
        Channel("rate", "rad/s", "rate", rate_of="yaw", scale=3.0),
    )
    action_channels = ()
    parameters: ClassVar = {
        "inertia": Parameter(INERTIA, "kg m^2", "about the centre of mass", low=1e-6)
    }

    def acceleration(self, q, v, u, force, p):
        weight = MASS * 9.81 * ARM * np.sin(q[:, 0])
        return ((force[:, 0] - weight) / (p.inertia + MASS * ARM**2))[:, None]


def swing(inertia, damping, seed=0):
    """12 s of it, rates with a noise of a few hundredths of their size."""
    times = 0.06 * np.arange(200)
    whole = inertia + MASS * ARM**2

    def slopes(_, x):
        return x[1], -(MASS * 9.81 * ARM * np.sin(x[0]) + damping * x[1]) / whole

    path = solve_ivp(slopes, times[[0, -1]], [0.4, 0.0], t_eval=times, rtol=1e-9, atol=1e-9).y
    rate = path[1] + 0.1 * np.random.default_rng(seed).standard_normal(len(times))
    states = np.stack([np.full_like(rate, np.nan), rate], axis=1)
    return Trajectory("swing", times, states, np.zeros((len(times) - 1, 0)))


def asked(damping):
    result = find_gap(Hung(), swing(1.25e-4, damping))
    return result, {v.label: v for v in result.verdicts if v.effect}


def test_a_little_damping_is_named_beside_what_shows_at_once():
    result, found = asked(3.8e-5)
    assert found["inertia"].kind == "confirmed"
    assert found["inertia"].parameters["change"].value == pytest.approx(-6.2e-5, rel=0.1)
    assert found["viscous_friction@yaw"].kind == "confirmed"
    number = found["viscous_friction@yaw"].parameters["coefficient"]
    assert number.low < 3.8e-5 < number.high and number.value == pytest.approx(3.8e-5, rel=0.2)
    assert any("what is slow hardly shows" in one.words for one in result.quality)


def test_nothing_slow_is_said_where_nothing_is():
    result, found = asked(0.0)
    assert set(found) == {"inertia"}
    assert not any("slow" in one.words for one in result.quality)
