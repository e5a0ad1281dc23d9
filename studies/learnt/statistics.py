"""Means over seeds with their intervals, and by how much policies differ in pairs."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
import pandas as pd
from scipy import stats

from studies.learnt.tables import BY_START

#: Values below which a number is written with its power of ten.
LEAST = 5e-4


@dataclasses.dataclass(frozen=True)
class Mean:
    """A mean over seeds.

    Attributes:
        value: The mean.
        half_width: Half of its 95 % interval by Student's t; NaN for a single seed.
        worst: The smallest value.
        count: Number of seeds.
    """

    value: float
    half_width: float
    worst: float
    count: int

    @property
    def low(self) -> float:
        """Lower end of the interval; the mean itself for a single seed."""
        return self.value - np.nan_to_num(self.half_width)

    @property
    def high(self) -> float:
        """Upper end of the interval; the mean itself for a single seed."""
        return self.value + np.nan_to_num(self.half_width)

    def __str__(self) -> str:
        if self.count == 1:
            return to_digits(self.value, 5)
        larger = max(abs(self.value), float(np.nan_to_num(self.half_width)))
        # Of what is small, two digits.
        size = np.floor(np.log10(larger)) if larger else 0
        return self._decimals(0 if abs(self.value) >= 100 else int(np.clip(1 - size, 1, 9)))

    def text(self, digits: int) -> str:
        """The mean to so many digits, at most four behind the point, or two and its power of ten,
        and its interval."""
        if not np.isfinite(self.value):
            return ""
        if 0 < abs(self.value) < LEAST:
            interval = "" if self.count == 1 else f"\u00a0±\u00a0{self.half_width:.1e}"
            return f"{self.value:.1e}{interval}"
        size = np.floor(np.log10(abs(self.value))) if self.value else 0
        return self._decimals(int(np.clip(digits - 1 - size, 0, 4)))

    def _decimals(self, digits: int) -> str:
        # With spaces that do not break a line.
        interval = "" if self.count == 1 else f"\u00a0±\u00a0{self.half_width:.{digits}f}"
        return f"{self.value:.{digits}f}{interval}"


def mean(values: Sequence[float]) -> Mean:
    """The mean of a sample of independent runs with its 95 % interval.

    Raises:
        ValueError: No values.
    """
    sample = np.asarray(values, float)
    if not len(sample):
        raise ValueError("a mean needs at least one value")
    half = np.nan
    if len(sample) > 1:
        half = float(stats.t.ppf(0.975, len(sample) - 1) * stats.sem(sample))
    return Mean(float(sample.mean()), half, float(sample.min()), len(sample))


def return_text(value: float) -> str:
    """A return as people write it: five digits, and of what is large the units."""
    return f"{value:.0f}" if 1e5 <= abs(value) < 1e9 else f"{value:.5g}"


def to_digits(value: float, digits: int) -> str:
    """A number of a column to so many digits, trailing zeros too: -41.000 stands by -93.618."""
    if 10**digits <= abs(value) < 1e9:
        return f"{value:.0f}"
    return f"{value:#.{digits}g}".removesuffix(".") if value else "0"


def above(one: pd.DataFrame, other: pd.DataFrame) -> list[float]:
    """Returns on the true system of one kind of policy less those of another.

    Args:
        one: Rows of ``tables.policy_rows``, one for each seed.
        other: The same of another kind; rows of other settings do not count.

    Returns:
        Of several seeds one difference for each that both have; of a single one a difference for
        each common start, or of the means if none was kept. Empty without a common seed.
    """
    keys = ["seed", *(["settings"] if "settings" in one and "settings" in other else [])]
    pairs = one.merge(other.drop_duplicates(keys), on=keys)
    if len(pairs) == 1:
        first, second = (pairs[f"{BY_START}_{side}"].iloc[0] for side in ("x", "y"))
        if common := [first[start] - second[start] for start in first if start in second]:
            return common
    return [float(value) for value in pairs["return_true_x"] - pairs["return_true_y"]]


def starts(rows: pd.DataFrame) -> int:
    """From how many starts each policy was tested on the true system."""
    return max([1, *rows[BY_START].map(len)])


def common_starts(rows: pd.DataFrame) -> bool:
    """Whether all policies of a seed were tested on the true system from the same starts."""
    tested = rows[rows[BY_START].map(len) > 0]
    begun = tested[BY_START].map(lambda found: frozenset(start for start, _ in found))
    return all(begun.groupby(tested["seed"]).nunique() <= 1)
