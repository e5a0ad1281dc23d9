"""A beam search: sets of effects grown by one until one more no longer pays."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from residual.gap.fitting.screening import Gain, Signatures, gains, pair_gains, triple_gains
from residual.gap.search.drives import driven
from residual.gap.search.exchange import from_screen, of_several_numbers, spelt_out
from residual.gap.search.pool import Key
from residual.gap.search.pursuit import add_pursued
from residual.gap.search.redundant import by_points
from residual.gap.search.sets import Proposals, Search
from residual.gap.search.significance import score
from residual.gap.search.sound import sound

Array = NDArray[np.float64]

#: Part of a law's gain from which on its special case is tried in its place.
HARDLY = 0.9
#: Error over that of the nominal simulator below which a drive is not asked for all its numbers.
FOUND = 0.5
#: Error of one effect for each joint over that of the best alone below which it is grown next.
JOINTLY = 0.25
#: Parameters that are tried as the third of them.
THIRDS = 4


def run(
    search: Search, seeds: Proposals | None = None, quiet: Callable[[Key], bool] = lambda _: False
) -> Key:
    """Grow sets until one more effect no longer pays; returns the one that forecasts best.

    Args:
        search: What is tried goes there.
        seeds: Sets to begin with.
        quiet: Whether a set leaves noise alone.
    """
    effort = search.effort
    frontier: list[Key] = [()]
    grown: set[Key] = set()
    reached = 1.0
    if seeds:
        known = [*search.add(seeds), *(key for key in seeds if key in search.validated)]
        frontier = best_of(search, known) or frontier
        reached = search.error(frontier[0])
        frontier = _alone(search, quiet) or frontier
    for level in range(1, effort.most + 1):
        if search.error(search.best()) < effort.enough:
            break
        fresh = [] if level > 1 or seeds else add_pursued(search)
        fresh += grow_each(search, frontier, quiet)
        grown.update(frontier)
        if not fresh or search.late:
            break
        frontier = _alone(search, quiet)
        if grown & set(frontier):
            break
        if frontier:
            continue
        frontier = best_of(search, fresh)
        now = search.error(frontier[0])
        if (level > 1 or seeds) and not _pays(search, frontier[0], reached):
            break
        reached = min(reached, now)
    if not (seeds or search.late or search.simulator.has_contacts or _alone(search, quiet)):
        three_at_once(search)
        guessed_drives(search)
    return search.best()


def extend(search: Search, key: Key) -> None:
    """Grow one set for as long as one more effect pays."""
    while not search.late:
        fresh = min(grow(search, key), key=search.error, default=key)
        if not improves(search, fresh, search.error(key)):
            return
        key = fresh


def improves(search: Search, key: Key, reached: float) -> bool:
    """Whether a set's error is so much less than what was reached that the search goes on."""
    effort = search.effort
    return reached >= effort.enough and search.error(key) < (1 - effort.stale) * reached


def _alone(search: Search, quiet: Callable[[Key], bool]) -> list[Key]:
    """The likeliest set, if it leaves noise alone: no other is worth growing then."""
    likeliest = min(search.usable(), key=lambda key: score(search, key))
    return [likeliest] if quiet(likeliest) else []


def best_of(search: Search, keys: list[Key]) -> list[Key]:
    """The sets that forecast best, with and without room for more, and those that fit best."""
    good = sorted((key for key in keys if search.sound(key)), key=search.error)
    room = [key for key in good if search.numbers(key) < search.most_numbers]
    by_merit = sorted(room, key=lambda k: search.tried[k].merit)[: search.effort.beam]
    return list(dict.fromkeys([*good[:1], *by_merit, *room[:1]]))


def _pays(search: Search, key: Key, reached: float) -> bool:
    """Whether a set is clearly better than what was reached, in all or in one joint."""
    if improves(search, key, reached):
        return True
    before = min((k for k in search.usable() if len(k) < len(key)), key=search.error)
    own = search.currency.by_group(search.validated[key].squares)
    its = search.currency.by_group(search.validated[before].squares)
    return bool((own < (1 - 2 * search.effort.stale) * its).any())


def grow_each(search: Search, frontier: list[Key], quiet: Callable[[Key], bool]) -> list[Key]:
    """Fit sets one effect larger than each of some, and those with one more at every joint."""
    fresh: list[Key] = []
    for key in frontier:
        more = grow(search, key, quiet)
        fresh += more + together(search, key, more)
    return fresh


def grow(search: Search, key: Key, quiet: Callable[[Key], bool] = lambda _: False) -> list[Key]:
    """Fit sets one effect larger than a fitted one, the best of the linear screen for each
    joint; those that turn out absurd are replaced by the next. From the nominal simulator on also
    some of two, unless one alone leaves noise."""
    around = search.signatures(key)
    places = search.currency.groups
    total = search.effort.grown if key else search.effort.singles
    wanted = max(2, -(-total // len(places)))
    # Of the simulator's own parameters there are few, so they come before time may be over.
    found = [] if key else boldly(search, parameters=True)
    for group in places:
        good = 0
        for gain in plainer(search, around, _by_gain(search, around, group), 3 * wanted):
            if search.late:
                break
            number = around.variants[gain.variants[0]].candidate
            fresh, theta = search.merged(key, [(number, gain.values[0])])
            if number in key or gain.value <= 0 or not search.fits_in(fresh):
                continue
            if fresh not in found and spelt_out(search, number, [i for k in found for i in k]):
                continue
            made = [] if fresh in found else sound(search, fresh, theta)
            good += fresh in found or bool(made)
            found += made
            if good >= wanted:
                break
    at_once = [] if key else together(search, key, found)
    found += at_once
    if not (key or _settles(search, found, at_once)):
        # The joints of what walks and hops move, so that the screen sees what rubs there.
        if not search.simulator.has_contacts:
            found += boldly(search, parameters=False)
        if _alone(search, quiet):
            return list(dict.fromkeys(found))
        if not search.simulator.has_contacts:
            found += driven(search)
        found += partners(search, found)
        # Laws of many numbers gain more, so that two of one number each have their own turn.
        for without in (by_points(search), of_several_numbers(search)):
            found += several(search, pair_gains(around, search.effort.pairs, without=without))
    return list(dict.fromkeys(found))


def _settles(search: Search, singles: list[Key], at_once: list[Key]) -> bool:
    """Whether one effect for each joint leaves so much less than any alone that no more of those
    are worth their time: what they may do beside it is asked from there on."""
    alone = min((search.error(key) for key in singles if len(key) == 1), default=0.0)
    return any(search.error(key) < JOINTLY * alone for key in at_once if search.sound(key))


def partners(search: Search, keys: list[Key]) -> list[Key]:
    """Fit every two of the best single effects together, from their numbers alone."""
    singles = sorted((key for key in keys if len(key) == 1), key=search.error)
    found: list[Key] = []
    for one, other in itertools.combinations(singles[: search.effort.partners], 2):
        fresh, theta = search.merged(one, [(other[0], search.own(other))])
        if search.fits_in(fresh) and not search.late:
            found += sound(search, fresh, theta)
    return found


def several(search: Search, ranked: list[Gain]) -> list[Key]:
    """Fit what the linear screen of the nominal simulator ranks, several effects at once."""
    found: list[Key] = []
    for gain in ranked:
        fresh, theta = from_screen(search, (), gain)
        if search.fits_in(fresh) and not search.late:
            found += sound(search, fresh, theta)
    return found


def three_at_once(search: Search) -> None:
    """Try the best threes of the linear screen, and more beside what is better than anything yet.

    An inflow that was forgotten hides that all outflows are too small, and none of the three takes
    anything off alone, nor does every two of them.
    """
    reached = search.error(search.best())
    ranked = triple_gains(search.signatures(()), search.effort.triples, by_points(search))
    found = min(several(search, ranked), key=search.error, default=())
    if improves(search, found, reached):
        extend(search, found)


def guessed_drives(search: Search) -> None:
    """Try what holds still with the gain of its drive and a parameter, if little is explained.

    Of a motor whose friction nobody measured, gain and time constant are guesses, too. Until all
    three are about right its starts and stops are missed, so that no two of them take anything off.
    """
    reached = search.error(search.best())
    if reached < FOUND:
        return
    screened = search.candidates[: search.screened]
    others = [n for n, one in enumerate(screened) if one.effect.enters == "parameter"][:THIRDS]
    found: list[Key] = []
    for two in [key for key in driven(search) if len(key) == 2 and search.numbers(key) == 2]:
        for third in others:
            start = 0.01 * screened[third].trials[0].values[0]
            fresh, theta = search.merged(two, [(third, start)])
            if third not in two and search.fits_in(fresh) and not search.late:
                found += sound(search, fresh, theta)
    best = min(found, key=search.error, default=())
    if improves(search, best, reached):
        extend(search, best)


def boldly(search: Search, parameters: bool) -> list[Key]:
    """Fit effects of which small trials tell little alone, such as friction that holds a joint.

    Args:
        search: What is tried goes there.
        parameters: Whether changes of parameters, or all other effects.
    """
    found: list[Key] = []
    for number, candidate in enumerate(search.candidates[: search.screened]):
        fresh = (number,)
        own = candidate.effect.enters == "parameter"
        start = candidate.bold
        if start is None and own and search.effort.parameters:
            start = 0.01 * candidate.trials[0].values[0]
        if start is None or own != parameters or search.late or not search.fits_in(fresh):
            continue
        found += sound(search, fresh, start)
    return found


def together(search: Search, key: Key, grown: list[Key]) -> list[Key]:
    """The set with the best addition for every joint at once, if several joints gain."""
    if len(search.currency.groups) < 2:
        return []
    base = search.currency.by_group(search.validated[key].squares)
    additions: dict[int, Array] = {}
    for group in range(len(base)):
        best, reached = None, (1 - 2 * search.effort.stale) * base[group]
        for fresh in grown:
            # A set that stands for an absurd one may lack a member, replaced by its twin.
            if len(fresh) != len(key) + 1 or not set(key) < set(fresh):
                continue
            error = search.currency.by_group(search.validated[fresh].squares)[group]
            if error < reached:
                best, reached = fresh, error
        if best is not None:
            (number,) = set(best) - set(key)
            fit = search.tried[best]
            additions[number] = fit.theta[fit.model.owner == best.index(number)]
    fresh, theta = search.merged(key, additions.items())
    if len(additions) < 2 or not search.fits_in(fresh):
        return []
    return sound(search, fresh, theta)


def plainer(search: Search, around: Signatures, ranked: list[Gain], most: int) -> list[Gain]:
    """The first gains, laws that gain hardly more than a special case of theirs replaced by it.

    In the linear picture a law gains no less than its special cases, however little its further
    numbers tell; as one of their family it has its turn when what is chosen meets its rivals.
    """
    owner = [around.variants[gain.variants[0]].candidate for gain in ranked]
    found: list[Gain] = []
    for gain, law in zip(ranked[:most], owner[:most], strict=True):
        cases = [g for g, own in zip(ranked, owner, strict=True) if search.contains(law, own)]
        instead = next((g for g in cases if g.value > HARDLY * gain.value), gain)
        found += [instead] if instead not in found else []
    return found


def _by_gain(search: Search, around: Signatures, group: tuple[int, ...]) -> list[Gain]:
    """Gains counted on the channels of one joint."""
    if len(search.currency.groups) < 2:
        return gains(around)
    rows = around.rows_of(group, len(search.fitter.samples.measured))
    return gains(around, around.residual[rows], around.matrix[rows])
