"""Enough is enough: the smallest set of effects that forecasts as well as any, and why not others.

A set must take a fifth off the error that the best smaller one leaves. A share of the nominal
error instead fails at both ends: where that is small, trifles take off a good part of it, and
where it is large, a true second effect takes off little. The fifth was measured (20 to 25 % serve)
on logs that the rule had not been made with; see docs/find-gap.md.

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

from residual.gap.search.currency import Currency
from residual.gap.search.known import departures, parameters
from residual.gap.search.sets import Key, Search
from residual.gap.search.significance import score

Array = NDArray[np.float64]

#: Part of the remaining error that an effect must take off: over all joints, or at one of them.
MATERIAL, AT_ONE = 0.2, 0.3
#: And of the nominal error.
TRIFLE = 0.005
#: Forecasts so many times as bad are not as good, whatever the chance is.
NEAR = 1.5
#: Loss over that of another set from which on a fit is no match, and the part of all blocks that
#: the other set may forecast worse.
NO_MATCH, ASTRAY = 9.0, 0.25
#: The same where one block alone says that the other set forecasts better.
FITS_BETTER = 2.0
#: Difference of the losses of sets that move exactly alike, as a share.
ROUNDING = 1e-4
#: Differences of relative errors below this are none, nor such below a part of the best error.
SAME, ALIKE = 0.01, 0.1


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


def no_match(search: Search, key: Key, other: Key) -> bool:
    """Whether a set leaves so much more of the data than another that it is out."""
    return search.tried[key].merit > NO_MATCH * search.tried[other].merit


def _fits_far_better(search: Search, key: Key, among: list[Key]) -> Key:
    """The likeliest set of those that a set is no match for, if any, or the set.

    Where one block alone makes its forecasts the better ones, less says that it is none: what lies
    in one block, such as a single step, is foretold from data that do not hold it.
    """
    own = search.currency.by_block(search.validated[key].squares).mean(axis=1)

    def seldom_behind(other: Key) -> bool:
        its = search.currency.by_block(search.validated[other].squares).mean(axis=1)
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
    than was known, and of those that move exactly alike the one in the simulator's own terms."""
    best = min(keys, key=search.error)
    near = [k for k in keys if _does_as_well(search, k, best)] or [best]
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
    return max(same, key=lambda k: parameters(search, k))


def _does_as_well(search: Search, key: Key, best: Key) -> bool:
    """Whether a set is as good as the best within chance, or surprises less and is next to it; of
    what undoes itself an imperfect simulator may make use, so that next to it is farther."""
    error, least = search.error(key), search.error(best)
    if search.undone(key) < search.undone(best) and error <= NEAR * least:
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


def _smaller(search: Search, key: Key, among: list[Key]) -> list[Key]:
    """The best set of fewer free numbers, and the set without each member, best first."""
    fewer = [k for k in among if search.numbers(k) < search.numbers(key)]
    best = min(fewer, key=search.error)
    nested = [k for k in among if len(k) == len(key) - 1 and set(k) < set(key)]
    return sorted({best, *nested}, key=search.error)


def as_good(search: Search, key: Key, best: Key) -> bool:
    """Whether a set forecasts as well as the best at every joint: within chance, or next to it."""
    currency = search.currency
    own, its = (search.validated[k].squares for k in (key, best))
    behind = currency.by_group(own) - currency.by_group(its)
    slack = np.minimum(SAME, ALIKE * currency.by_group(its))
    return all(
        behind[group] <= slack[group] or currency.clearly(own, its, group) <= 1.0
        for group in range(len(behind))
    )


def material(search: Search, smaller: Key, larger: Key) -> bool:
    """Whether a set takes a fifth off what a smaller one leaves, or three tenths at one joint."""
    squares = search.validated
    return takes_off(search.currency, squares[smaller].squares, squares[larger].squares)


def takes_off(currency: Currency, worse: Array, better: Array) -> bool:
    """The same of mean squared errors of blocks, each (B, m)."""
    before, after = currency.by_group(worse), currency.by_group(better)
    gained = before - after
    if gained.mean() <= 0:
        return False
    over_all = gained.mean() > max(MATERIAL * before.mean(), TRIFLE)
    return bool(over_all or ((gained > AT_ONE * before) & (gained > TRIFLE)).any())


def helps(search: Search, smaller: Key, larger: Key) -> bool:
    """Whether a set forecasts better than a smaller one beyond a standard error."""
    squares = search.validated
    gained, error = search.currency.difference(squares[smaller].squares, squares[larger].squares)
    return gained > error


def reasons(search: Search, chosen: Key) -> dict[Key, str]:
    """One reason for every set that was tried and not chosen."""
    found = {}
    own = search.error(chosen)
    for key in search.tried:
        if key == chosen:
            continue
        if key in search.unfit:
            found[key] = "did not converge"
        elif key in search.refused:
            found[key] = search.refused[key]
        elif search.error(key) > own + SAME:
            found[key] = f"{search.error(key) / max(own, 1e-12):.2g} times the error" + _worst(
                search, key, chosen
            )
        elif set(chosen) < set(key):
            found[key] = _not_enough(search, key, chosen)
        else:
            found[key] = "as good, with as many or more numbers"
    return found


def _not_enough(search: Search, key: Key, chosen: Key) -> str:
    """Why what a set holds beyond the chosen one is not asked for."""
    taken = max(1 - search.error(key) / max(search.error(chosen), 1e-12), 0.0)
    more = len(key) - len(chosen)
    off = f"{100 * taken:.2g} % off what remains" + (f" with {more} effects more" * (more > 1))
    if taken < 1 - (1 - MATERIAL) ** more:
        return f"takes only {off}"
    if as_good(search, chosen, key):
        return f"takes {off}, no more than chance may"
    if score(search, chosen) <= score(search, key):
        return f"takes {off}, and fits no better"
    return f"takes {off}, but these data do not establish it"


def _worst(search: Search, key: Key, chosen: Key) -> str:
    """The block in which a set falls behind most."""
    currency, blocks = search.currency, search.fitter.blocks
    behind = currency.by_block(search.validated[key].squares).sum(axis=1)
    behind -= currency.by_block(search.validated[chosen].squares).sum(axis=1)
    number = int(behind.argmax())
    windows, samples = blocks.windows, search.fitter.samples
    first = int((blocks.block == number).argmax())
    start = samples.times[windows.index[first, 0]]
    digits = 6 if start < 1e6 else 12  # of a date, counted from 1970
    return f", most at {start:.{digits}g} s of {samples.names[windows.run[first]]}"
