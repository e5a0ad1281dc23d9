"""Laws given by points, for where no law of the library follows the true one."""

from __future__ import annotations

import dataclasses
from typing import ClassVar

import numpy as np

from sims.effects.actuator import StaticActuatorEffect
from sims.effects.base import number
from sims.effects.curve import Along, CurveBetween, CurveFromZero
from sims.effects.joint import JointEffect, Value

#: What a curve by command can do, or nearly: the last two have a kink.
STATIC = ("actuator_gain", "quadratic_actuator", "dead_zone", "saturation")


@dataclasses.dataclass(frozen=True)
class FrictionCurve(JointEffect, CurveFromZero):
    """Friction of three measured sizes, and of none at rest.

    ``slow``, ``medium`` and ``fast`` are its sizes at a third, at two thirds and at all of
    the speed ``full``. Between them runs the cubic through the three and zero, so that
    friction in proportion to speed, its square or its cube is one of its cases; beyond ``full`` it
    stays what it is there.
    """

    slow: Value = number(low=0.0, force=1, share=0.1)
    medium: Value = number(low=0.0, force=1, share=0.1)
    fast: Value = number(low=0.0, force=1, share=0.1)
    full: Value = number(1.0, role="fixed", low=0.0, rate=1)

    name: ClassVar[str] = "friction_curve"
    sentence: ClassVar[str] = "Friction whose size follows speed along a curve of its own."
    needs: ClassVar[str] = "motion at many speeds"
    family: ClassVar[str] = "dissipation"
    special_cases: ClassVar[tuple[str, ...]] = ("viscous_friction", "quadratic_drag")
    along: ClassVar[Along] = "rate"
    by: ClassVar[str] = "speed"
    gives: ClassVar[str] = "friction"

    def force(self, q: Value, v: Value) -> Value:
        """Force opposing the rate."""
        return -np.sign(v) * self.at(v)


@dataclasses.dataclass(frozen=True)
class ForceCurve(JointEffect, CurveBetween):
    """A force that depends on position only, given at six positions from ``low`` to ``high``.

    They lie at equal distances; between them runs a cubic spline, so that springs at rest anywhere
    and loads are its cases; beyond the ends it stays what it is there. An angle is not wrapped.
    """

    first: Value = number(force=1, share=0.1)
    second: Value = number(force=1, share=0.1)
    third: Value = number(force=1, share=0.1)
    fourth: Value = number(force=1, share=0.1)
    fifth: Value = number(force=1, share=0.1)
    sixth: Value = number(force=1, share=0.1)
    low: Value = number(-1.0, role="fixed", position=1)
    high: Value = number(1.0, role="fixed", position=1)

    name: ClassVar[str] = "force_curve"
    sentence: ClassVar[str] = "A force that follows position along a curve of its own."
    needs: ClassVar[str] = "a wide range of positions"
    family: ClassVar[str] = "spring"
    special_cases: ClassVar[tuple[str, ...]] = ("linear_spring", "cubic_spring", "constant_load")
    follows_rate: ClassVar[bool] = False
    along: ClassVar[Along] = "position"
    by: ClassVar[str] = "position"
    gives: ClassVar[str] = "force"

    def force(self, q: Value, v: Value) -> Value:
        """Force at position ``q``."""
        return self.at(q)


@dataclasses.dataclass(frozen=True)
class StateCurve(ForceCurve):
    """A rate of change of a first-order system that depends on the state only, as a force curve
    does on position: the outflow of a tank by its level, the heat that a hot body radiates."""

    name: ClassVar[str] = "state_curve"
    sentence: ClassVar[str] = "A rate of change that follows the state along a curve of its own."
    needs: ClassVar[str] = "small and large values"
    family: ClassVar[str] = ""
    special_cases: ClassVar[tuple[str, ...]] = ("constant_load", "proportional_loss")
    mechanical: ClassVar[bool] = False
    follows_rate: ClassVar[bool] = True
    by: ClassVar[str] = "state"
    gives: ClassVar[str] = "rate of change"
    if_it_moves: ClassVar[str] = "force_curve, or friction_curve"

    def force(self, q: Value, v: Value) -> Value:
        """Rate of change; the state of a first-order system counts as a rate."""
        return self.at(v)


@dataclasses.dataclass(frozen=True)
class SymmetricInputCurve(StaticActuatorEffect, CurveFromZero):
    """What an actuator adds to a command, given at four commands; the same in both directions.

    ``first`` to ``fourth`` are added at a quarter, half, three quarters and all of the command
    ``full``. Between them and zero runs a cubic spline, so that a gain and a square are its cases;
    beyond ``full`` as much is added as there.
    """

    first: Value = number(input=1, share=0.1)
    second: Value = number(input=1, share=0.1)
    third: Value = number(input=1, share=0.1)
    fourth: Value = number(input=1, share=0.1)
    full: Value = number(1.0, role="fixed", low=0.0, input=1)

    name: ClassVar[str] = "symmetric_input_curve"
    sentence: ClassVar[str] = (
        "The actuator answers along a curve of its own, the same in both directions."
    )
    needs: ClassVar[str] = "small, middling and large inputs"
    special_cases: ClassVar[tuple[str, ...]] = STATIC
    upstream_of_sensor: ClassVar[bool] = True
    stage: ClassVar[int] = 2
    along: ClassVar[Along] = "input"
    by: ClassVar[str] = "command"
    gives: ClassVar[str] = "added input"

    def shape(self, u: Value) -> Value:
        """What comes out for the command."""
        return u + np.sign(u) * self.at(u)


@dataclasses.dataclass(frozen=True)
class InputCurve(StaticActuatorEffect, CurveBetween):
    """What an actuator adds to a command, given at seven commands from ``low`` to ``high``.

    They lie at equal distances; between them runs a cubic spline, so that a gain and a bias are its
    cases, and what is the same in both directions nearly is; beyond the ends as much is added as
    there.
    """

    first: Value = number(input=1, share=0.1)
    second: Value = number(input=1, share=0.1)
    third: Value = number(input=1, share=0.1)
    fourth: Value = number(input=1, share=0.1)
    fifth: Value = number(input=1, share=0.1)
    sixth: Value = number(input=1, share=0.1)
    seventh: Value = number(input=1, share=0.1)
    low: Value = number(-1.0, role="fixed", input=1)
    high: Value = number(1.0, role="fixed", input=1)

    name: ClassVar[str] = "input_curve"
    sentence: ClassVar[str] = "The actuator answers along a curve of its own, not in proportion."
    needs: ClassVar[str] = "small, middling and large inputs"
    special_cases: ClassVar[tuple[str, ...]] = (
        *STATIC, "actuator_bias", "symmetric_input_curve", "asymmetric_actuator",
    )  # fmt: skip
    upstream_of_sensor: ClassVar[bool] = True
    stage: ClassVar[int] = 2
    along: ClassVar[Along] = "input"
    by: ClassVar[str] = "command"
    gives: ClassVar[str] = "added input"

    def shape(self, u: Value) -> Value:
        """What comes out for the command."""
        return u + self.at(u)


CURVES = (FrictionCurve, ForceCurve, StateCurve, SymmetricInputCurve, InputCurve)


def cases_of_curves(name: str) -> frozenset[str]:
    """Names of the curves of which an effect is a case."""
    return frozenset(curve.name for curve in CURVES if name in curve.special_cases)
