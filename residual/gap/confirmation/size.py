"""Whether a strength may be zero, and what is known of its size if it is not."""

from __future__ import annotations

import dataclasses

import numpy as np

from residual.gap.confirmation.claim import Claim
from residual.gap.confirmation.resolution import below_a_step
from residual.gap.model.candidates import Knob
from residual.gap.result import Number
from residual.gap.search.sets import Search
from sims.effects.curves import StateCurve

#: Part of a strength below which an effect hardly acts.
NEARLY_NONE = 0.1
#: Size of one of two strengths over that of the other from which on it matters.
AS_LARGE = 0.5
#: Times as large as what was found that a strength may be, beyond which its size is open.
OPEN = 10.0
#: Residual over noise from which on much is left, and ends of an interval over one another beyond
#: which it does not tell the size beside that.
FAR, SPAN = 10.0, 5.0


def may_vanish(search: Search, claim: Claim) -> bool:
    """Whether none of an effect's strengths is known to be other than zero.

    Of a curve along a state two of its points have to be: a single one is a place, and may stand
    for whatever else happens while the state is there, such as the sun at noon.
    """
    numbers = [claim.numbers[knob.field] for knob in strengths(search, claim)]
    told = sum(not n.low <= 0 <= n.high or (n.at_bound and n.value != 0) for n in numbers)
    least = 2 if isinstance(search.candidates[claim.number].effect, StateCurve) else 1
    return bool(numbers) and told < least


def may_be_none(search: Search, claim: Claim) -> bool:
    """Whether every strength of an effect may be zero, or less than a part of what was found."""
    if may_vanish(search, claim):
        return True
    numbers = [claim.numbers[knob.field] for knob in strengths(search, claim)]
    told = [n for n in numbers if n.value and not n.at_bound]
    return bool(told) and max(min(n.low / n.value, n.high / n.value) for n in told) < NEARLY_NONE


def half_open(search: Search, claim: Claim) -> bool:
    """Whether one of an effect's two strengths may be zero, though it was found at half the size of
    the other or more: friction by direction, of which a dead zone and a bias may be half. Or though
    the other begins above it: friction that may be none in motion is no friction."""
    knobs = strengths(search, claim)
    numbers = {knob.field: claim.numbers[knob.field] for knob in knobs}
    if len({number.unit for number in numbers.values()}) != 1 or len(numbers) != 2:
        return False
    most = max(abs(number.value) for number in numbers.values())
    under = {knob.above for knob in knobs}
    return any(
        number.low <= 0 <= number.high
        and (field in under or 0 < most <= abs(number.value) / AS_LARGE)
        for field, number in numbers.items()
    )


def size_open(search: Search, claim: Claim, left: float = 1.0) -> bool:
    """Whether every strength of an effect may be many times as large as what was found, even if all
    else were exact: friction beside an inertia that may be anything is friction all the same.

    Where much is left, what has no name may make it larger or smaller, too: then its whole interval
    has to tell its size.

    Args:
        search: Has the effect.
        claim: With its numbers.
        left: Times the noise that all chosen ones leave.
    """
    numbers = [claim.numbers[knob.field] for knob in strengths(search, claim)]
    told = [n for n in numbers if n.value and not n.at_bound]
    larger = [max(end / n.value for end in n.if_exact or (n.low, n.high)) for n in told]
    spans = [_span(n) for n in told]
    return bool(told) and (min(larger) > OPEN or (left >= FAR and min(spans) > SPAN))


def _span(number: Number) -> float:
    """The larger end of an interval over the smaller one."""
    ends = sorted(abs(end) for end in (number.low, number.high))
    return ends[1] / max(ends[0], 1e-300) if number.low * number.high > 0 else np.inf


def with_size(search: Search, claim: Claim) -> Claim:
    """The claim, without zero in its interval if the effect is there for certain.

    What only a ratio of numbers is well known of, such as friction over a gain where inertia hardly
    matters, has a standard deviation as large as itself. Its size is then a matter of factors: the
    interval is that of the logarithm (delta method). Of several strengths any one might be zero, so
    their intervals stay.
    """
    only = strengths(search, claim)
    uncertain = claim.there and may_be_none(search, claim)
    if not uncertain or len(only) != 1 or not claim.numbers[only[0].field].value:
        return claim
    (knob,) = only
    number = claim.numbers[knob.field]
    low, high = by_factors(number.value, number.low, number.high, knob)
    if min(low / number.value, high / number.value) < NEARLY_NONE:
        return claim
    exact = number.if_exact and by_factors(number.value, *number.if_exact, knob)
    number = dataclasses.replace(number, low=low, high=high, if_exact=exact)
    numbers = {**claim.numbers, knob.field: number}
    within = claim.within_step and below_a_step(search, claim.number, numbers)
    return dataclasses.replace(claim, numbers=numbers, within_step=within)


def by_factors(value: float, low: float, high: float, knob: Knob) -> tuple[float, float]:
    """An interval about a value, each side as far on a logarithmic scale as on a linear one.

    A side that a bound cuts off goes as far as the other.
    """
    below, above = value - low, high - value
    if low <= knob.low:
        below = max(below, above)
    if high >= knob.high:
        above = max(below, above)
    with np.errstate(over="ignore"):
        sides = value * np.exp(np.array([-below, above]) / value)
    return max(float(sides.min()), knob.low), min(float(sides.max()), knob.high)


def strengths(search: Search, claim: Claim) -> list[Knob]:
    """The numbers of an effect without which it is absent."""
    knobs = search.candidates[claim.number].knobs
    return [knob for knob in knobs if knob.strength and knob.field in claim.numbers]
