"""Rarer effects that stand out beside the library before anything is fitted."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from residual.gap.fitting.screening import (
    Signatures,
    gains,
    pair_gains,
    signatures,
    trials,
)
from residual.gap.model.candidates import Candidate
from residual.gap.search.sets import Search

#: Part of the cost that the library's best effect may leave without others being looked at, and of
#: what it leaves that one of these leaves at most.
QUARTER = 0.25


def at_sight(search: Search, further: Sequence[Candidate]) -> list[Candidate]:
    """Those that leave a fraction of what the best of the library leaves, in the linear picture:
    alone, or two between the same joints.

    Args:
        search: In which nothing is fitted but the nominal simulator.
        further: What is not on offer in it.
    """
    if not further:
        return []
    own = search.signatures(())
    cost = float(own.residual @ own.residual)
    left = cost - max((gain.value for gain in gains(own)), default=0.0)
    if left < QUARTER * cost:
        return []
    nominal = search.tried[()]
    others = signatures(nominal, trials(further), search.fitter.columns(nominal, further))
    enough = cost - QUARTER * left
    found = {others.variants[g.variants[0]].candidate for g in gains(others) if g.value > enough}
    for two in of_one_pair(further):
        found |= set(two) if _together(others, two) > enough else set()
    return [one for number, one in enumerate(further) if number in found]


def of_one_pair(pool: Sequence[Candidate]) -> list[tuple[int, int]]:
    """Numbers of two effects between the same two joints: a gyroscope couples its axes both ways,
    a belt is a spring and a damper."""
    pairs = [sorted(one.effect.pair) for one in pool]
    both = itertools.combinations(range(len(pool)), 2)
    return [(a, b) for a, b in both if pairs[a] and pairs[a] == pairs[b]]


def _together(found: Signatures, two: tuple[int, int]) -> float:
    """What two candidates take off the cost together."""
    others = [number for number in range(found.variants[-1].candidate + 1) if number not in two]
    return max((gain.value for gain in pair_gains(found, top=1, without=others)), default=0.0)
