"""A simulator that counts in degrees or turns gets the answer of one that counts in rad."""

import math

import numpy as np
import pytest
from held import path

from residual.gap import find_gap
from residual.gap.data.samples import Samples
from residual.gap.preparation.alternatives import conventions
from residual.trajectories import Trajectory
from sims.effects import Cogging, library
from sims.equations import EquationOfMotion
from sims.simulator import TURNS, Channel

DT, DAMPING, GAIN, SINE, ORDER = 0.01, 2.0, 30.0, 8.0, 4


def motor(unit):
    """A motor on a shaft; ``force`` is an acceleration of the shaft in its unit."""
    one = TURNS[unit] / math.tau

    class Motor(EquationOfMotion):
        dt = DT
        state_channels = (
            Channel("angle", unit, "position", scale=one),
            Channel("speed", f"{unit}/s", "rate", rate_of="angle", scale=5.0 * one),
        )
        action_channels = (Channel("drive", "1", "input", low=-1.0, high=1.0),)
        parameters = {}

        def acceleration(self, q, v, u, force, p):
            return GAIN * one * u[:, :1] - DAMPING * v[:, :1] + force

    return Motor


def log(unit):
    """The shaft in rad as SciPy integrates it with a cogging that no simulator has."""
    rng = np.random.default_rng(4)
    drive = np.repeat(0.7 * rng.uniform(-1, 1, 24), 40)

    def moves(_, x, u):
        return [x[1], GAIN * u - DAMPING * x[1] + SINE * math.sin(ORDER * x[0])]

    states = path(moves, [0.0, 0.0], drive, DT, atol=1e-10)
    states = states + rng.normal(0.0, [2e-3, 2e-2], states.shape)
    times = np.arange(len(states)) * DT
    return Trajectory("run", times, states * TURNS[unit] / math.tau, drive[:, None])


@pytest.mark.parametrize("unit", ["deg", "rev"])
def test_cogging_is_that_of_the_turn_in_any_unit_of_angle(unit):
    one = TURNS[unit] / math.tau
    plain = motor("rad")(effects=[Cogging("angle", SINE, 1.0, ORDER)])
    other = motor(unit)(effects=[Cogging("angle", SINE * one, one, ORDER)])
    rng = np.random.default_rng(0)
    states, drive = rng.uniform(-5.0, 5.0, (50, 2)), rng.uniform(-1, 1, (50, 1))
    told = plain.step(states, drive) * one
    np.testing.assert_allclose(other.step(states * one, drive), told, rtol=1e-9, atol=1e-9 * one)
    names = [{e.name for e in library(motor(u)())} for u in ("rad", unit)]
    assert names[0] == names[1]


def test_quarter_turns_are_those_of_the_unit():
    zeros = {
        one.says
        for one in conventions(motor("deg")(), Samples.join([log("deg")], 4), {})
        if one.turned
    }
    assert {"`offset: 90` for angle", "`offset: 180` for angle", "`offset: -90` for angle"} <= zeros


def test_the_answer_is_the_same_in_degrees():
    offered = ("cogging", "viscous_friction", "coulomb_friction", "constant_load", "actuator_gain")
    found = {unit: find_gap(motor(unit)(), [log(unit)], effects=offered) for unit in ("rad", "deg")}
    named = {
        unit: {v.effect: v for v in answer.verdicts if v.kind in ("confirmed", "minor")}
        for unit, answer in found.items()
    }
    assert named["rad"].keys() == named["deg"].keys() == {"cogging"}
    rad, deg = (named[unit]["cogging"].parameters["sine"] for unit in ("rad", "deg"))
    assert rad.value == pytest.approx(SINE, rel=0.05) and rad.low <= SINE <= rad.high
    assert math.radians(deg.value) == pytest.approx(rad.value, rel=1e-3)
