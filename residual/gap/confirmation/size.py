"""Whether a strength may be zero, and what is known of its size if it is not."""

from __future__ import annotations

import dataclasses

import numpy as np

from residual.gap.confirmation.claim import Claim
from residual.gap.result import Number
from residual.gap.search.sets import Search
from residual.gap.model.candidates import Knob

#: Part of a strength below which an effect hardly acts.
NEARLY_NONE = 0.1


def may_vanish(search: Search, claim: Claim) -> bool:
    """Whether none of an effect's strengths is known to be other than zero."""
    numbers = [claim.numbers[knob.field] for knob in strengths(search, claim)]
    return bool(numbers) and all(
        n.low <= 0 <= n.high and (not n.at_bound or n.value == 0) for n in numbers
    )


def may_be_none(search: Search, claim: Claim) -> bool:
    """Whether every strength of an effect may be zero, or less than a part of what was found."""
    numbers = [claim.numbers[knob.field] for knob in strengths(search, claim)]
    told = [n for n in numbers if n.value and not n.at_bound]
    hardly = bool(told) and max(min(n.low / n.value, n.high / n.value) for n in told) < NEARLY_NONE
    return hardly or may_vanish(search, claim)


def with_size(search: Search, claim: Claim) -> Claim:
    """An effect that is there for certain, its strength with an interval that leaves out zero.

    What only a ratio of numbers is well known of, such as friction over a gain where inertia hardly
    matters, has a standard deviation as large as itself. Its size is then a matter of factors: the
    interval is that of the logarithm (delta method). Of several strengths any one might be zero, so
    their intervals stay.
    """
    only = strengths(search, claim)
    if len(only) != 1 or not claim.numbers[only[0].field].value:
        return claim
    (knob,) = only
    number = claim.numbers[knob.field]
    low, high = by_factors(number.value, number.low, number.high, knob)
    exact = number.if_exact and by_factors(number.value, *number.if_exact, knob)
    number = dataclasses.replace(number, low=low, high=high, if_exact=exact)
    return dataclasses.replace(claim, numbers={**claim.numbers, knob.field: number})


def by_factors(value: float, low: float, high: float, knob: Knob) -> tuple[float, float]:
    """An interval about a value on a logarithmic scale, as wide there as it was on a linear one."""
    factor = float(np.exp(max(high - value, value - low) / abs(value)))
    least, most = sorted((value / factor, value * factor))
    return max(least, knob.low), min(most, knob.high)


def strengths(search: Search, claim: Claim) -> list[Knob]:
    """The numbers of an effect without which it is absent."""
    knobs = search.candidates[claim.number].knobs
    return [knob for knob in knobs if knob.strength and knob.field in claim.numbers]
