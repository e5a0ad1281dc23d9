"""Sets with one member missing, or exchanged for what may do its work."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.fitting.screening import Gain, gains, pair_gains
from residual.gap.search.in_one import add_in_one
from residual.gap.search.parted import add_parted
from residual.gap.search.pool import Key, all_but
from residual.gap.search.redundant import doubles
from residual.gap.search.sets import Search

Array = NDArray[np.float64]

#: Part of the best gain by the linear screen below which no rival is worth a fit.
HOPELESS = 0.5
#: Spellings of one effect, as cogging has one for every order, that are tried for one place.
SPELLINGS = 2
#: Effects that hold still tried in place of one that does, whatever the linear screen says.
STILL = 3
#: Pairs that are tried in place of one effect of two or three numbers.
SPLITS, SEVERAL = 2, (2, 3)
#: Pairs that are tried in place of two members.
PAIRS = 3
#: Error of a pair in place of a member over that with the member, less one, up to which it grows.
NEXT_TO = 0.1
#: Effects that move as another one does in these data, tried beside it: under a constant input a
#: gain is a load, a dead zone and dry friction, and none of them may lack for the others.
ALIKE = 4


def add_without_each(search: Search, key: Key) -> None:
    """Fit what is left of a set without each of its members."""
    for gone in key:
        smaller, theta = search.merged(key, (), drop=(gone,))
        search.add({smaller: theta})


def add_exchanged(search: Search, key: Key, most: int) -> None:
    """Fit sets in which one member of a set has been exchanged for what may do its work.

    These are the effects that gain most where the member is missing, and its whole family; in
    place of what holds still, such as a dead zone, all that does, such as dry friction: of these
    a linear screen tells little.

    Args:
        search: What is tried goes there, and what was not asked for lack of time.
        key: A fitted set.
        most: Effects that are tried in place of each member, beside its family.
    """
    add_without_each(search, key)
    add_parted(search, key)
    add_in_one(search, key)
    without = {gone: all_but(key, gone) for gone in key if all_but(key, gone) in search.tried}
    # What takes off most is asked first: time may be over before the last.
    for gone in sorted(without, key=lambda n: search.error(without[n]), reverse=True):
        rest = without[gone]
        if search.out_of_time:
            search.unasked.add((key, gone))
            continue
        search.unasked.discard((key, gone))
        for number, start in _rivals(search, key, gone, most):
            fresh, theta = search.merged(key, [(number, start)], drop=(gone,))
            search.add({fresh: theta})
        _add_plainer(search, key, gone)
        if len(search.candidates[gone].knobs) in SEVERAL:
            _add_split(search, rest, gone)


def add_pairs_exchanged(search: Search, key: Key) -> None:
    """Fit sets in which two members have been exchanged for the two that gain most together.

    What takes nothing off alone, nor beside one member of a wrong set, may be right together: an
    inflow that was forgotten hides that all outflows are too small.

    Args:
        search: What is tried goes there.
        key: A fitted set.
    """
    for two in itertools.combinations(key, 2):
        rest, theta = search.merged(key, (), drop=two)
        search.add({rest: theta})
        if search.late:
            return
        _add_pairs(search, rest, _pairs_beside(search, rest)[:PAIRS])


def _rivals(search: Search, key: Key, gone: int, most: int) -> list[tuple[int, Array]]:
    """What may do a member's work, and numbers from which it is fitted."""
    rest, family = all_but(key, gone), search.family(gone)
    around = search.signatures(rest, near=key)
    ranked = gains(around)
    found: dict[int, Array] = {}
    still: set[int] = set()
    alike: set[int] = set()
    for gain in ranked:
        number = around.variants[gain.variants[0]].candidate
        if number in key or number in found or spelt_out(search, number, list(found)):
            continue
        if doubles(search, (*rest, number)):
            continue
        bold = search.candidates[number].bold
        near = len(found) - len(alike) < most or (family and search.family(number) == family)
        if both_hold_still(search, gone, number) and len(still) < STILL:
            still.add(number)
        elif len(alike) < ALIKE and any(search.same_motion(rest, n, number) for n in found):
            alike.add(number)
        elif not near or gain.value < HOPELESS * ranked[0].value:
            continue
        found[number] = gain.values[0] if gain.value > 0 or bold is None else bold
    return list(found.items())


def _add_plainer(search: Search, key: Key, gone: int) -> None:
    """Fit special cases of a member in its place, from the mean of its strengths.

    Also those that were fitted before: they may have ended elsewhere than the law that holds them.
    """
    model = search.tried[key].model
    own = [j for j in range(len(model)) if model.owner[j] == key.index(gone)]
    strengths = [search.tried[key].theta[j] for j in own if model.knobs[j].strength]
    for number, case in enumerate(search.candidates[: search.screened]):
        if number in key or not search.contains(gone, number) or len(case.knobs) != 1:
            continue
        if not case.knobs[0].strength:
            continue
        mean = np.clip(np.mean(strengths, keepdims=True), case.knobs[0].low, case.knobs[0].high)
        fresh, theta = search.merged(key, [(number, mean)], (gone,))
        if fresh in search.tried:
            search.fit(fresh, theta)
        search.add({fresh: theta})


def _add_split(search: Search, rest: Key, gone: int) -> None:
    """Fit sets in which two effects of one number each stand for one of two or three.

    For what holds still, such as friction by direction, so does the best pair with each of what
    does, such as a dead zone and a bias.
    """
    ranked = _pairs_beside(search, rest, gone)
    pairs = ranked[:SPLITS]
    if search.candidates[gone].effect.holds_still:
        variants = search.signatures(rest).variants
        for number in range(search.screened):
            its = (p for p in ranked if number in {variants[v].candidate for v in p.variants})
            if both_hold_still(search, gone, number):
                pairs += itertools.islice(its, 1)
    _add_pairs(search, rest, pairs)


def _pairs_beside(search: Search, rest: Key, *without: int) -> list[Gain]:
    """Pairs of effects of one number by what they gain beside a set, best first."""
    around = search.signatures(rest)
    without = (*of_several_numbers(search), *rest, *without)
    return pair_gains(around, len(around.variants) ** 2, without=without)


def _add_pairs(search: Search, rest: Key, pairs: Iterable[Gain]) -> None:
    """Fit a set with each of some pairs."""
    for pair in pairs:
        fresh, theta = from_screen(search, rest, pair)
        search.add({fresh: theta} if search.fits_in(fresh) else {})
        if fresh in search.tried:
            add_parted(search, fresh)


def of_several_numbers(search: Search) -> list[int]:
    """Candidates of more than one number."""
    return [n for n, one in enumerate(search.candidates) if len(one.knobs) != 1]


def from_screen(search: Search, rest: Key, gain: Gain) -> tuple[Key, Array]:
    """The set with what the linear screen around another one ranks, and where its fit begins."""
    variants = search.signatures(rest).variants
    numbers = [variants[v].candidate for v in gain.variants]
    return search.merged(rest, zip(numbers, gain.values, strict=True))


def both_hold_still(search: Search, one: int, other: int) -> bool:
    """Whether two effects keep from moving what hardly moves."""
    return all(search.candidates[number].effect.holds_still for number in (one, other))


def spelt_out(search: Search, number: int, taken: Sequence[int]) -> bool:
    """Whether enough spellings of a candidate's effect are taken, so that others get a turn."""
    label = search.candidates[number].label
    return sum(search.candidates[other].label == label for other in set(taken)) >= SPELLINGS


def exchanged(search: Search, key: Key, number: int, nearly: bool = False) -> list[tuple[int, Key]]:
    """What was fitted in place of a member, and the set with it.

    Laws of which the member is a special case are left out: they are it, with more freedom.

    Args:
        search: With what was fitted.
        key: The set.
        number: Its member.
        nearly: Whether sets count, too, whose numbers are absurd, but known so badly that they
            need not be.
    """
    rest = set(key) - {number}
    found = []
    doubtful = [k for k in search.nearly if k not in search.unfit] if nearly else []
    for rival in [*search.usable(), *doubtful]:
        if len(rival) == len(key) and rest < set(rival) and number not in rival:
            (other,) = set(rival) - rest
            if not search.contains(other, number):
                found.append((other, rival))
    return found


def split(search: Search, key: Key, number: int) -> list[tuple[Key, list[int]]]:
    """Sets with two effects in place of one that has as many numbers, and those two.

    A spring with a free rest, for example, is a longer pendulum with an offset of its sensor.
    """
    rest = set(key) - {number}
    return [
        (rival, sorted(set(rival) - rest))
        for rival in search.usable()
        if len(rival) == len(key) + 1
        and rest < set(rival)
        and number not in rival
        and search.numbers(rival) <= search.numbers(key)
    ]


def as_good_splits(search: Search, key: Key) -> list[Key]:
    """For each member the set with two effects in its place that forecasts best, if it is next to
    the set or better: what stands for that has not grown yet."""
    found = []
    for number in key:
        rivals = [rival for rival, _ in split(search, key, number)]
        best = min(rivals, key=search.error, default=key)
        if best != key and search.error(best) <= (1 + NEXT_TO) * search.error(key):
            found.append(best)
    return found
