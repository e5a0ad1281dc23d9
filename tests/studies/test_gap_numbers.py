"""A limit is told as the command at which it is reached, too; a gain as the unit that it may be."""

from types import SimpleNamespace

import pytest

from sims import Channel
from sims.effects import ActuatorBias, ActuatorGain, DeadZone, Saturation
from studies.gap.numbers import as_commanded, as_in_a_unit

LIMIT = Saturation("pwm", 240.0)


@pytest.mark.parametrize(
    ("beside", "says"),
    [
        ([], ""),
        ([ActuatorGain("pwm", 0.5)], "reached at 160 of the command as logged"),
        ([ActuatorGain("pwm", 0.5), DeadZone("pwm", 20.0), ActuatorBias("pwm", 4.0)],
         "reached at 176 of the command as logged"),
        ([ActuatorGain("other", 0.5)], ""),
        ([ActuatorGain("pwm", -2.0)], ""),  # it acts the other way: never reached
    ],
)  # fmt: skip
def test_a_limit_is_told_in_counts_of_the_log(beside, says):
    result = SimpleNamespace(effects=(*beside, LIMIT))
    level = SimpleNamespace(unit="1")
    verdict = SimpleNamespace(label=str(LIMIT), parameters={"level": level})
    assert as_commanded(verdict, result) == says
    assert not as_commanded(SimpleNamespace(label="dead_zone@pwm", parameters={}), result)


@pytest.mark.parametrize(
    ("where", "field", "low", "high", "says"),
    [
        ("force", "gain", 8.2, 9.2, "as if force were logged in kgf"),
        ("force", "gain", 0.5, 12.0, ""),  # too much may be meant
        ("force", "gain", 0.3, 0.5, ""),
        ("speed", "scale", 8.2, 9.2, "as if speed were logged in rpm"),
        ("speed", "scale", -0.05, 0.05, ""),
        ("elsewhere", "gain", 8.2, 9.2, ""),
    ],
)
def test_a_gain_that_is_a_unit_is_told_as_that(where, field, low, high, says):
    channels = {
        "physical_channels": [Channel("speed", "rad/s", "rate")],
        "action_channels": [Channel("force", "N", "input")],
    }
    number = SimpleNamespace(unit="1", low=low, high=high)
    verdict = SimpleNamespace(where=where, parameters={field: number})
    assert as_in_a_unit(verdict, SimpleNamespace(**channels)) == says
