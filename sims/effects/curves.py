"""Laws given by points of a curve, for where no law of the library follows the true one."""

from __future__ import annotations

import abc
import dataclasses
import functools
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from sims.effects.actuator import StaticActuatorEffect
from sims.effects.base import Effect, number
from sims.effects.joint import JointEffect, Value

if TYPE_CHECKING:
    from sims.host import HostSimulator


Along = Literal["rate", "position", "input"]


class Curve(Effect, abc.ABC):
    """What a law that is given by points has beside an effect; between them it is a cubic.

    Attributes:
        along: Which of ``measures`` it follows.
        by: The same in a word for people.
        gives: What it gives there, in such words.
    """

    along: ClassVar[Along]
    by: ClassVar[str]
    gives: ClassVar[str]

    @property
    @abc.abstractmethod
    def reach(self) -> tuple[float, float]:
        """Between which two values the points lie."""

    @abc.abstractmethod
    def at(self, x: Value) -> Value:
        """Its value at ``x``."""


@dataclasses.dataclass(frozen=True)
class FrictionCurve(JointEffect, Curve):
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

    @property
    def reach(self) -> tuple[float, float]:
        """From rest to the fastest."""
        return 0.0, self.full

    def suited_to(self, low: float, high: float) -> Self:
        """The same with ``full`` at the fastest of the speeds."""
        return _up_to(self, low, high)

    def point_of(self, field: str) -> tuple[float, str] | None:
        """The speed at which friction is of a size."""
        return _point(self.reach, ("", "slow", "medium", "fast"), field, "rate")

    def at(self, x: Value) -> Value:
        """Size of friction at a speed."""
        return _through(np.abs(x) / self.full, (0.0, self.slow, self.medium, self.fast))

    def force(self, q: Value, v: Value) -> Value:
        """Force opposing the rate."""
        return -np.sign(v) * self.at(v)


@dataclasses.dataclass(frozen=True)
class ForceCurve(JointEffect, Curve):
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

    @property
    def reach(self) -> tuple[float, float]:
        """From the first point to the last."""
        return self.low, self.high

    def suited_to(self, low: float, high: float) -> Self:
        """The same with its points between the two positions."""
        return self.with_values(low=_three_digits(low), high=_three_digits(high))

    def point_of(self, field: str) -> tuple[float, str] | None:
        """The position at which the force is of a size."""
        return _point(self.reach, self.strengths(), field, "position")

    def at(self, x: Value) -> Value:
        """Force at a position."""
        values = [getattr(self, name) for name in self.strengths()]
        return _through((x - self.low) / (self.high - self.low), values)

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

    def force(self, q: Value, v: Value) -> Value:
        """Rate of change; the state of a first-order system counts as a rate."""
        return self.at(v)

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """See ``JointEffect.measures``; what moves has a force curve for it."""
        if any(joint.name == self.joint and joint.rate is not None for joint in simulator.joints):
            raise ValueError(
                f"{self.name} needs the state of a first-order system, and {self.joint!r} moves: "
                "there it is force_curve, or friction_curve"
            )
        return super().measures(simulator)


@dataclasses.dataclass(frozen=True)
class InputCurve(StaticActuatorEffect, Curve):
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

    name: ClassVar[str] = "input_curve"
    sentence: ClassVar[str] = "The actuator answers along a curve of its own, not in proportion."
    needs: ClassVar[str] = "small, middling and large inputs"
    special_cases: ClassVar[tuple[str, ...]] = ("actuator_gain", "quadratic_actuator")
    upstream_of_sensor: ClassVar[bool] = True
    stage: ClassVar[int] = 2
    along: ClassVar[Along] = "input"
    by: ClassVar[str] = "command"
    gives: ClassVar[str] = "added input"

    @property
    def surprising(self) -> bool:
        """Always: most actuators are made to answer in proportion."""
        return True

    @property
    def reach(self) -> tuple[float, float]:
        """From none to the largest command."""
        return 0.0, self.full

    def suited_to(self, low: float, high: float) -> Self:
        """The same with ``full`` at the largest of the commands."""
        return _up_to(self, low, high)

    def point_of(self, field: str) -> tuple[float, str] | None:
        """The command at which so much is added."""
        return _point(self.reach, ("", *self.strengths()), field, "input")

    def at(self, x: Value) -> Value:
        """What is added to a command that is positive."""
        values = [getattr(self, name) for name in self.strengths()]
        return _through(np.abs(x) / self.full, (0.0, *values))

    def shape(self, u: Value) -> Value:
        """What comes out for the command."""
        return u + np.sign(u) * self.at(u)


CURVES: tuple[type[FrictionCurve | ForceCurve | InputCurve], ...] = (
    FrictionCurve,
    ForceCurve,
    StateCurve,
    InputCurve,
)


def cases_of_curves(name: str) -> frozenset[str]:
    """Names of the curves of which an effect is a case."""
    return frozenset(curve.name for curve in CURVES if name in curve.special_cases)


@functools.cache
def _basis(points: int) -> NDArray[np.float64]:
    """Coefficients of the cubic splines that are 1 at one of equidistant points and 0 at others.

    Returns:
        shape (pieces, 4, points): by piece between two points, by power of the way into it.
    """
    spline = CubicSpline(np.arange(points), np.eye(points), bc_type="not-a-knot")
    return np.ascontiguousarray(spline.c[::-1].transpose(1, 0, 2))


def _through(way: Value, values: Sequence[Value]) -> Value:
    """The cubic spline through values at equidistant points, constant beyond.

    Args:
        way: From 0 at the first point to 1 at the last, any shape.
        values: Scalars, or arrays of one entry per row.
    """
    basis = _basis(len(values))
    t = np.clip(way, 0.0, 1.0) * (len(values) - 1)
    piece = np.minimum(t.astype(int) if np.ndim(t) else int(t), len(basis) - 1)
    into = t - piece
    of_piece = basis[piece]
    found = 0.0 * t
    for j, value in enumerate(values):
        c = of_piece[..., j]
        found = found + value * (
            c[..., 0] + into * (c[..., 1] + into * (c[..., 2] + into * c[..., 3]))
        )
    return found


def _point(
    reach: tuple[float, float], names: Sequence[str], field: str, along: str
) -> tuple[float, str] | None:
    """Where the number ``field`` of a curve holds; ``names`` of all, an empty one for zero."""
    if not field or field not in names:
        return None
    low, high = reach
    return low + names.index(field) / (len(names) - 1) * (high - low), along


def _up_to(curve: Any, low: float, high: float) -> Any:
    """The curve with ``full`` at the larger size of two values, if there is one."""
    full = float(max(abs(low), abs(high)))
    return curve.with_values(full=_three_digits(full)) if full > 0 else curve


def _three_digits(value: float) -> float:
    return float(f"{value:.3g}")
