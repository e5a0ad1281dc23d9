"""Friction whose size follows speed along a curve of its own, where no law of the library does."""

from __future__ import annotations

import dataclasses
from typing import ClassVar

import numpy as np

from sims.effects.base import number
from sims.effects.joint import JointEffect, Value


@dataclasses.dataclass(frozen=True)
class FrictionCurve(JointEffect):
    """Friction of three measured sizes, and of none at rest.

    ``slow``, ``medium`` and ``fast`` are its sizes at a third, at two thirds and at all of
    the speed ``full``. Between them runs the cubic through the three and zero (Lagrange's), so that
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

    def point_of(self, field: str) -> tuple[float, str] | None:
        """The speed at which friction is of a size."""
        shares = {"slow": 1 / 3, "medium": 2 / 3, "fast": 1.0}
        return (self.full * shares[field], "rate") if field in shares else None

    def force(self, q: Value, v: Value) -> Value:
        """Force opposing the rate."""
        x = np.minimum(np.abs(v) / self.full, 1.0)
        slow = 3.0 * (x - 2 / 3) * (x - 1.0) * self.slow
        medium = -3.0 * (x - 1 / 3) * (x - 1.0) * self.medium
        fast = (x - 1 / 3) * (x - 2 / 3) * self.fast
        return -np.sign(v) * 4.5 * x * (slow + medium + fast)
