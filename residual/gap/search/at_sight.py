"""Rarer effects that stand out beside the library before anything is fitted."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from residual.gap.fitting.screening import Signatures, gains, pair_gains
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.model.candidates import Candidate
from residual.gap.search.sets import Search

#: Part of the cost that the library's best effect may leave without others being looked at.
LITTLE = 0.05
#: Part of what it leaves that one of these leaves at most.
QUARTER = 0.25
#: Part of what one leaves that two leave at most.
HALF = 0.5


def at_sight(search: Search, further: Sequence[Candidate]) -> list[Candidate]:
    """Those that leave a fraction of what the best of the library leaves in the linear picture,
    alone, or two between the same joints.

    Args:
        search: With what is on offer.
        further: What is not.
    """
    if not (further and isinstance(search.fitter, SmoothFitter)):
        return []
    own = search.measured_path.offered
    cost = float(own.residual @ own.residual)
    left = cost - max((gain.value for gain in gains(own)), default=0.0)
    if left < LITTLE * cost:
        return []
    others = search.measured_path.of(further)
    alone = dict.fromkeys(range(len(further)), 0.0)
    for gain in gains(others):
        number = others.variants[gain.variants[0]].candidate
        alone[number] = max(alone[number], gain.value)
    found = {number for number, value in alone.items() if cost - value < QUARTER * left}
    for two in of_one_pair(further):
        both = cost - _together(others, two)
        if both < QUARTER * left and both < HALF * (cost - max(alone[n] for n in two)):
            found |= set(two)
    return [one for number, one in enumerate(further) if number in found]


def of_one_pair(pool: Sequence[Candidate]) -> list[tuple[int, int]]:
    """Numbers of two effects between the same two joints: a gyroscope couples its axes both ways,
    a belt is a spring and a damper."""
    pairs = [sorted(one.effect.pair) for one in pool]
    both = itertools.combinations(range(len(pool)), 2)
    return [(a, b) for a, b in both if pairs[a] and pairs[a] == pairs[b]]


def _together(found: Signatures, two: tuple[int, int]) -> float:
    """What two candidates take off the cost together."""
    others = {variant.candidate for variant in found.variants} - set(two)
    return max((gain.value for gain in pair_gains(found, 1, without=tuple(others))), default=0.0)
