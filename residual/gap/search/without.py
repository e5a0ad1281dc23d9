"""Whole answers without one of the chosen effects: not one thing in its place, but any set.

What is exchanged one for one leaves the rest of a set as it is. Where several effects together are
nothing but an imitation of one, others that share little with them may imitate it as well: a tank
that leaks is a weaker pump whose level is read too high, or wider outlets and one level misread.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

from residual.gap.search.beam import best_of, grow_each
from residual.gap.search.exchange import add_exchanged, add_pairs_exchanged
from residual.gap.search.pool import Key
from residual.gap.search.sets import Search
from residual.gap.search.significance import score

#: Effects tried in place of each member of the best such set, and rounds of that.
RIVALS, ROUNDS = 2, 3


def add_answers_without(
    search: Search, key: Key, number: int, quiet: Callable[[Key], bool], until: float
) -> None:
    """Search for sets without a member that have no more effects, and no more numbers.

    Args:
        search: What is tried goes there.
        key: A fitted set of several.
        number: Its member.
        quiet: Whether a set leaves noise alone.
        until: When to stop, on the clock of ``time.process_time``.
    """

    def likeliest() -> Key:
        return min(search.usable(), key=lambda one: score(search, one))

    with _barring(search, akin(search, number), search.numbers(key), until):
        frontier: list[Key] = [()]
        for _ in key:
            frontier = best_of(search, grow_each(search, frontier, quiet))
            if not frontier:
                break
        for _ in range(ROUNDS):
            best = likeliest()
            add_exchanged(search, best, RIVALS)
            add_pairs_exchanged(search, best)
            if search.late or likeliest() == best:
                break


def answers_without(search: Search, key: Key, number: int) -> list[Key]:
    """Fitted sets that have no more effects than one, and no more numbers, and none like a member
    of it, those that fit best first."""
    out = akin(search, number)
    found = [
        other
        for other in search.usable()
        if 0 < len(other) <= len(key)
        and search.numbers(other) <= search.numbers(key)
        and out.isdisjoint(other)
    ]
    return sorted(found, key=lambda one: score(search, one))


def akin(search: Search, number: int) -> frozenset[int]:
    """A candidate with its spellings, its whole family, and all that moves exactly as it does."""
    family, label = search.family(number), search.candidates[number].label
    labels = {label, *(twin.label for twin in search.twins_of(number))}
    return frozenset(
        other
        for other, one in enumerate(search.candidates)
        if one.label in labels or (family and search.family(other) == family)
    )


@contextlib.contextmanager
def _barring(search: Search, numbers: frozenset[int], most: int, until: float) -> Iterator[None]:
    """Within this context no set holds some candidates, or more numbers than so many, and none is
    tried after a time."""
    before = search.barred, search.at_most, search.until, search.weigh_until
    search.barred, search.at_most = numbers, most
    search.until = search.weigh_until = until
    try:
        yield
    finally:
        search.barred, search.at_most, search.until, search.weigh_until = before
