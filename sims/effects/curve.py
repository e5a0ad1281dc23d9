"""What laws given by points have in common: a cubic spline through values at equal distances."""

from __future__ import annotations

import abc
import functools
from collections.abc import Sequence
from typing import Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray

from sims.effects.base import Effect

Value = Any  # float, or an array with one entry per row
Along = Literal["rate", "position", "input", "channel"]


class Curve(Effect, abc.ABC):
    """A law by points: its strengths are its values there, and beyond the ends it is level.

    Attributes:
        along: Which of ``measures`` it follows.
        by: The same in a word for people.
        gives: What it gives there, in such words.
    """

    compound: ClassVar[bool] = True
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

    def _points(self) -> tuple[str, ...]:
        """Names of the points in order, an empty one for a zero that is known."""
        return self.strengths()

    def _values(self) -> list[Value]:
        return [getattr(self, name) if name else 0.0 for name in self._points()]

    def point_of(self, field: str) -> tuple[float, str] | None:
        """Where a number of it holds."""
        names = self._points()
        if not field or field not in names:
            return None
        low, high = self.reach
        return low + names.index(field) / (len(names) - 1) * (high - low), self.along


class CurveFromZero(Curve):
    """A curve of sizes from zero to ``full``, the same in both directions."""

    full: Value

    def _points(self) -> tuple[str, ...]:
        return ("", *self.strengths())

    @property
    def reach(self) -> tuple[float, float]:
        """From zero to the largest."""
        return 0.0, self.full

    def suited_to(self, low: float, high: float) -> Self:
        """The same with ``full`` at the larger size of two values, if there is one."""
        full = three_digits(max(abs(low), abs(high)))
        return self.with_values(full=full) if full > 0 else self

    def at(self, x: Value) -> Value:
        """Its size at ``x`` of either sign."""
        return through(np.abs(x) / self.full, self._values())


class CurveBetween(Curve):
    """A curve of values from ``low`` to ``high``."""

    low: Value
    high: Value

    @property
    def reach(self) -> tuple[float, float]:
        """From the first point to the last."""
        return self.low, self.high

    def suited_to(self, low: float, high: float) -> Self:
        """The same with its points between two values."""
        return self.with_values(low=three_digits(low), high=three_digits(high))

    def at(self, x: Value) -> Value:
        """Its value at ``x``."""
        return through((x - self.low) / (self.high - self.low), self._values())


@functools.cache
def _basis(points: int) -> NDArray[np.float64]:
    """Coefficients of the cubic splines that are 1 at one of equidistant points and 0 at others.

    Returns:
        shape (points, 4, pieces): by power of the way into a piece between two points.
    """
    from scipy.interpolate import CubicSpline  # half a second to load, for few

    spline = CubicSpline(np.arange(points), np.eye(points), bc_type="not-a-knot")
    return np.ascontiguousarray(spline.c[::-1].transpose(2, 0, 1))


def through(way: Value, values: Sequence[Value]) -> Value:
    """The cubic spline through values at equidistant points, level beyond.

    Args:
        way: From 0 at the first point to 1 at the last, any shape.
        values: Scalars, or arrays of one entry per row.
    """
    basis = _basis(len(values))
    t = np.clip(way, 0.0, 1.0) * (len(values) - 1)
    # What is no number, as of a trial that ran away, stays none.
    piece = np.minimum(np.where(np.isnan(t), 0.0, t).astype(int), basis.shape[-1] - 1)
    into, found = t - piece, 0.0 * t
    for value, (a, b, c, d) in zip(values, basis.take(piece, axis=-1), strict=True):
        found = found + value * (a + into * (b + into * (c + into * d)))
    return found


def three_digits(value: float) -> float:
    """Rounded to three significant digits."""
    return float(f"{value:.3g}")
