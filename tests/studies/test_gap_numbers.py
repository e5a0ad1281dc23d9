"""A limit of what comes out of an actuator is told as the command at which it is reached, too."""

from types import SimpleNamespace

import pytest

from sims.effects import ActuatorBias, ActuatorGain, DeadZone, Saturation
from studies.gap.numbers import as_commanded

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
