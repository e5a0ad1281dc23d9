"""Enough is enough: the smallest set of effects that forecasts as well as any, and why not others.

A set must take a fifth off the error that the best smaller one leaves. A share of the nominal
error instead fails at both ends: where that is small, trifles take off a good part of it, and
where it is large, a true second effect takes off little. The fifth was measured (20 to 25 % serve)
on logs that the rule had not been made with; see docs/find-gap-rules.md.

Where motion hangs on a hair, as what sticks and breaks away does, the forecast of a block or two
may go astray whatever is known. Fits to all data say more there: what lowers their loss no more
than chance does is not needed, and a set that leaves a third of what another does, and forecasts
few blocks worse, comes before it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.search.comparisons import (
    ALIKE,
    MATERIAL,
    SAME,
    TRIFLE,
    as_good,
    helps,
    material,
    no_match,
)
from residual.gap.search.known import departures, extent, parameters
from residual.gap.search.pool import Key
from residual.gap.search.reasons import reasons
from residual.gap.search.sets import Search
from residual.gap.search.significance import score

Array = NDArray[np.float64]

#: Forecasts so many times as bad are not as good, whatever the chance is.
NEAR = 1.5
#: Part of all blocks that a set which is no match for the fit of another may forecast better.
ASTRAY = 0.25
#: Loss over that of another set from which on a fit is no match where one block alone says that it
#: forecasts better.
FITS_BETTER = 2.0
#: Effects, or parameters far off, by which a set of one number more has to depart less.
LESS = 0.5
#: Difference of the losses of sets that move exactly alike, as a share.
ROUNDING = 1e-4


@dataclasses.dataclass(frozen=True)
class Choice:
    """The chosen set, and one reason for every other.

    Attributes:
        key: The set.
        reasons: Why each of the other sets was not chosen, in words.
        minor: Candidates that larger sets held, which forecast better by too little.
    """

    key: Key
    reasons: dict[Key, str]
    minor: tuple[int, ...] = ()


def choose(search: Search, enough: Callable[[Key], bool] = lambda _: False) -> Choice:
    """The set with the fewest numbers among those that forecast best, each effect material.

    Args:
        search: Fitted and cross-validated sets.
        enough: Whether a set leaves so little more than noise that no larger one is asked for.
    """
    open_ = search.usable()
    best = min(open_, key=search.error)
    fewest = min(search.numbers(key) for key in open_ if as_good(search, key, best))
    key = better_fit(search, [key for key in open_ if search.numbers(key) <= fewest])
    minor: list[int] = []
    passed: list[Key] = []
    while key:
        passed.append(key)
        smaller = _smaller(search, key, open_)
        short = next((k for k in smaller if enough(k) or _spared(search, k, passed)), None)
        if short is None:
            break
        if helps(search, short, key):
            minor += sorted(set(key) - set(short))
        key = short
    if key:
        key = _fits_far_better(search, _plainer(search, key, open_), open_)
        key = _less_departed(search, key, open_)
        key = better_fit(search, [key, *(k for k in open_ if _fits_alike(search, k, key))])
    if key and not helps(search, (), key):
        key = ()
    kept = tuple(number for number in dict.fromkeys(minor) if number not in key)
    return Choice(key, reasons(search, key), kept)


def _spared(search: Search, key: Key, passed: Sequence[Key]) -> bool:
    """Whether nothing is asked for that the last set holds beyond a smaller one, nor that the
    steps to it have given up together."""
    return not (asked_for(search, key, passed[-1]) or gives_up(search, key, passed))


def asked_for(search: Search, smaller: Key, larger: Key) -> bool:
    """Whether what a set holds beyond a smaller one improves forecasts, and no less the fit."""
    nested = set(smaller) < set(larger)
    if nested and score(search, smaller) <= score(search, larger):
        return False
    return material(search, smaller, larger)


def gives_up(search: Search, key: Key, passed: Sequence[Key]) -> bool:
    """Whether the steps from one set to a smaller one have given up more together than a fifth for
    each effect, although no single one did."""
    for larger in passed:
        if set(key) < set(larger) and score(search, key) <= score(search, larger):
            continue
        steps, least = max(len(larger) - len(key), 1), search.error(larger)
        if search.error(key) > max(least / (1 - MATERIAL) ** steps, least + steps * TRIFLE):
            return True
    return False


def _fits_far_better(search: Search, key: Key, among: list[Key]) -> Key:
    """The likeliest set of those that a set is no match for, if any, or the set.

    Where one block alone makes its forecasts the better ones, less says that it is none: what lies
    in one block, such as a single step, is foretold from data that do not hold it.
    """
    currency = search.currency
    own = currency.in_blocks(search.validated[key].squares)

    def seldom_behind(other: Key) -> bool:
        its = currency.in_blocks(search.validated[other].squares)
        return bool((its > own + SAME / len(own)).mean() <= ASTRAY)

    def out(other: Key) -> bool:
        return no_match(search, key, other) or _ahead_by_one_block(search, key, other)

    far = [k for k in among if out(k) and seldom_behind(k)]
    if not far:
        return key
    likeliest = min(far, key=lambda k: score(search, k))
    least = score(search, likeliest) + search.fitter.tie(search.tried[()])
    near = [k for k in far if score(search, k) <= least]
    return better_fit(search, near)


def _ahead_by_one_block(search: Search, key: Key, other: Key) -> bool:
    """Whether a set fits clearly worse than another with no more numbers, and forecasts better in
    one block alone."""
    losses = search.tried[key].merit, search.tried[other].merit
    if search.numbers(other) > search.numbers(key) or losses[0] <= FITS_BETTER * losses[1]:
        return False
    own, its = (search.validated[k].squares for k in (key, other))
    joints = range(len(search.currency.groups))
    return all(search.currency.clearly(its, own, joint, True) <= 1.0 for joint in joints)


def better_fit(search: Search, keys: list[Key]) -> Key:
    """The set that forecasts best, or one that is as good within chance, of sizes that surprise
    less, and fits better; of sets that no data tell apart the one with the least to be otherwise
    than was known, and of those that move exactly alike the one in the simulator's own terms, or
    with the smallest numbers."""
    best = min(keys, key=search.error)
    near = [k for k in keys if _does_as_well(search, k, best) or _fits_alike(search, k, best)]
    near = near or [best]
    fewest = min(search.surprises(k) for k in near)
    near = sorted(
        (k for k in near if search.surprises(k) == fewest), key=lambda k: search.tried[k].merit
    )
    most = search.tried[near[0]].merit + search.fitter.tie(search.tried[()])
    alike = [k for k in near if search.tried[k].merit <= most]
    least = min(alike, key=lambda k: departures(search, k))
    same = [
        k
        for k in alike
        if search.tried[k].merit <= (1 + ROUNDING) * search.tried[least].merit
        and departures(search, k) <= departures(search, least)
    ]
    return max(same, key=lambda k: (parameters(search, k), -extent(search, k)))


def _fits_alike(search: Search, key: Key, best: Key) -> bool:
    """Whether a set of as many numbers reaches the very loss of another: then it makes the same
    motion, and what it forecasts otherwise, of the one block that tells its numbers and was left
    out, is due to how they are written alone."""
    losses = [search.tried[k].merit for k in (key, best)]
    alike = abs(losses[0] - losses[1]) <= ROUNDING * losses[1]
    helped = losses[1] < (1 - ROUNDING) * search.tried[()].merit
    return alike and helped and search.numbers(key) == search.numbers(best)


def _does_as_well(search: Search, key: Key, best: Key) -> bool:
    """Whether a set is as good as the best within chance, or surprises less and is next to it; next
    to what is unlikely, of which an imperfect simulator may make use, is farther."""
    error, least = search.error(key), search.error(best)
    if search.unlikely(key) < search.unlikely(best) and error <= NEAR * least:
        return search.surprises(key) < search.surprises(best)
    if search.surprises(key) < search.surprises(best) and error <= (1 + ALIKE) * least:
        return True
    return as_good(search, key, best) and error < NEAR * least


def _plainer(search: Search, key: Key, among: list[Key]) -> Key:
    """A set of as few numbers that forecasts as well and has sizes that surprise less, if any."""
    near = [
        k
        for k in among
        if search.numbers(k) <= search.numbers(key)
        and search.surprises(k) < search.surprises(key)
        and _does_as_well(search, k, key)
    ]
    return better_fit(search, near) if near else key


def _less_departed(search: Search, key: Key, among: list[Key]) -> Key:
    """A set of no more effects and one number more that forecasts no worse, and departs less from
    what was known by half an effect or more: a spring beside a parameter within its tolerance,
    before two parameters that are far off."""
    near = [
        k
        for k in among
        if len(k) <= len(key)
        and search.numbers(k) == search.numbers(key) + 1
        and search.error(k) <= search.error(key)
        and search.surprises(k) <= search.surprises(key)
        and departures(search, k) <= departures(search, key) - LESS
    ]
    return better_fit(search, near) if near else key


def _smaller(search: Search, key: Key, among: list[Key]) -> list[Key]:
    """The best set of fewer free numbers, and the set without each member, best first."""
    fewer = [k for k in among if search.numbers(k) < search.numbers(key)]
    best = min(fewer, key=search.error)
    nested = [k for k in among if len(k) == len(key) - 1 and set(k) < set(key)]
    return sorted({best, *nested}, key=search.error)
