"""Constant pushes, and the effects at several places that together look like them.

One wind blows along two axes, and drag couples them: with the wind along one alone, the drag along
the other stays wrong, so that either does no better than a constant push.
"""

from __future__ import annotations

from collections.abc import Sequence

from residual.gap.model.candidates import Candidate
from residual.gap.search.pool import Key
from residual.gap.search.sets import Search


def constant(chosen: Sequence[Candidate]) -> list[int]:
    """Places of the constant pushes."""
    return [place for place, one in enumerate(chosen) if one.effect.creeps]


def of_one_kind(pool: Sequence[Candidate]) -> list[list[int]]:
    """Numbers of the effects of each kind that pushes in the mean, of which there are several."""
    kinds: dict[str, list[int]] = {}
    for number, one in enumerate(pool):
        if one.effect.pushes:
            kinds.setdefault(one.effect.name, []).append(number)
    return [numbers for numbers in kinds.values() if len(numbers) > 1]


def add_in_place_of_pushes(search: Search, key: Key, fresh: Sequence[int]) -> None:
    """Fit what is left of a set without its constant pushes, if there are several, with all effects
    of one kind that look like them.

    Args:
        search: What is tried goes there.
        key: A fitted set.
        fresh: Candidates that may stand for them.
    """
    gone = tuple(key[place] for place in constant(search.tried[key].model.chosen[: len(key)]))
    if len(gone) < 2:
        return
    for places in of_one_kind([search.candidates[number] for number in fresh]):
        numbers = [fresh[place] for place in places]
        starts = [(n, search.candidates[n].trials[0].values[0]) for n in numbers]
        more, theta = search.merged(key, starts, drop=gone)
        search.add({more: theta} if search.fits_in(more) else {})
