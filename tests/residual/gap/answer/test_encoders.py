"""What a clock that is off would do is not certain where sensors disagree by as much."""

import dataclasses
from types import SimpleNamespace

import pytest

from residual.gap.answer.encoders import by_sensor_or_clock
from residual.gap.confirmation.claim import Claim
from residual.gap.result import Number
from sims.effects import CoulombFriction, ParameterChange
from sims.pendulum_equation import PendulumEquation

PLAIN = Claim(0, {}, (), (), (), (), True, True, True, False, (0.9, 0.8, 1.0))
PENDULUM = PendulumEquation()
LENGTH = PENDULUM.parameters["length"].value


@pytest.mark.parametrize(("times", "disagree", "off"), [
    (1.04**2, {"angle": -0.0385}, True), (1 / 1.04**2, {"angle": -0.0385}, True),
    (1.04, {"angle": -0.0385}, True), (1.3, {"angle": -0.0385}, False),
    (1.04**2, {}, False),
])  # fmt: skip
def test_a_parameter_may_be_the_clock(times, disagree, off):
    change = (times - 1) * LENGTH
    claim = dataclasses.replace(PLAIN, numbers={"change": Number(change, change, change, "m")})
    length = SimpleNamespace(effect=ParameterChange("length", 0.0))
    search = SimpleNamespace(candidates=[length], simulator=PENDULUM)
    assert by_sensor_or_clock(claim, search, disagree) is off


def test_friction_is_no_matter_of_the_clock():
    claim = dataclasses.replace(PLAIN, numbers={"level": Number(0.04, 0.03, 0.05, "N m")})
    friction = SimpleNamespace(effect=CoulombFriction("pivot"))
    search = SimpleNamespace(candidates=[friction], simulator=PENDULUM)
    assert not by_sensor_or_clock(claim, search, {"angle": 0.04})
