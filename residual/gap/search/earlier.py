"""What an earlier search found, in a search with other effects on offer."""

from __future__ import annotations

import numpy as np

from residual.gap.fitting.screening import gains
from residual.gap.search.choice import choose
from residual.gap.search.pool import Key
from residual.gap.search.pushes import add_in_place_of_pushes
from residual.gap.search.sets import Proposals, Search

#: Error with an effect that was lacking over that without, from which on none of them helps.
HELPS = 0.95
#: The same where sets were judged in vain before, in weights in which little shows.
HELPS_MUCH = 0.7
#: Sets that a new search begins with, and their error over that of the best.
SEEDS, HOPEFUL = 12, 3.0


def near_best(search: Search) -> list[Key]:
    """The sets worth trying again: what is chosen, those that forecast best, and that fit best, of
    all and of every number of effects.

    The right one may forecast badly: what stands on the verge of breaking loose does so by chance.
    """
    best = sorted(search.usable(), key=search.error)[:SEEDS]
    good = [key for key in best if search.error(key) <= HOPEFUL * search.error(best[0])]
    fit = sorted(search.usable(), key=lambda key: search.tried[key].merit)
    of_size = {len(key): key for key in reversed(fit)}
    few = sorted(of_size.values(), key=len)
    return list(dict.fromkeys([choose(search).key, *good, *fit[: search.effort.beam], *few]))


def carried(earlier: Search, search: Search) -> Proposals:
    """The best sets of an earlier search, as sets of another one's candidates."""
    found: Proposals = {}
    for key in near_best(earlier):
        found |= brought(earlier, key, search) if key else {}
    return found


def brought(earlier: Search, key: Key, search: Search) -> Proposals:
    """A set of an earlier search with what was fitted, as one of another search's candidates.

    Nothing if these lack one of its effects.
    """
    places = {candidate.effect: i for i, candidate in enumerate(search.candidates)}
    effects = [earlier.candidates[i].effect for i in key]
    if not all(effect in places for effect in effects):
        return {}
    model, theta = earlier.tried[key].model, earlier.own(key)
    owner = model.owner[: len(theta)]
    own = {places[effect]: theta[owner == at] for at, effect in enumerate(effects)}
    fresh = tuple(sorted(own))
    return {fresh: np.concatenate([own[n] for n in fresh]) if fresh else np.zeros(0)}


def add_what_it_lacked(earlier: Search, search: Search) -> None:
    """Fit what an earlier search chose, and what forecast best in it, with each effect that it
    lacked beside: a search is made again for these, and may not end before it comes to them.

    Each is fitted alone, too: what stood for it may be far from it, and keep it there.
    """
    fresh = _lacked(earlier, search)
    chosen = dict.fromkeys((choose(earlier).key, earlier.best(), ()))
    own = [key for before in chosen for key in brought(earlier, before, search)]
    for key in own if fresh else ():
        if key not in search.tried:
            continue
        around = search.signatures(key)
        for gain in gains(around):
            number = around.variants[gain.variants[0]].candidate
            if number in fresh and (key or not search.late):
                more, theta = search.merged(key, [(number, gain.values[0])])
                search.add({more: theta})
        add_in_place_of_pushes(search, key, sorted(fresh))


def is_in_vain(earlier: Search, search: Search, helps: float = HELPS) -> bool:
    """Whether nothing that an earlier search lacked helps beside what was found: the search that is
    made for it has no need to grow sets.

    Args:
        earlier: That search.
        search: The one that is made.
        helps: Error with something new over that without, up to which it does.
    """
    fresh = _lacked(earlier, search)
    errors: dict[bool, float] = {True: np.inf, False: np.inf}
    for key in search.usable():
        new = not fresh.isdisjoint(key)
        errors[new] = min(errors[new], search.error(key))
    return bool(fresh) and errors[True] > helps * errors[False]


def worth_another_look(earlier: Search, search: Search) -> list[Key]:
    """Sets to be judged in other weights before nothing that was lacking is said to help: what is
    chosen, and of those with something new, and of those without, the ones that forecast and fit
    best."""
    fresh = _lacked(earlier, search)
    new = [key for key in search.usable() if not fresh.isdisjoint(key)]
    old = [key for key in search.usable() if fresh.isdisjoint(key)]
    best = [near_best(search)[0]]
    for some in filter(None, (old, new)):
        best += [min(some, key=search.error), min(some, key=lambda k: search.tried[k].merit)]
    return [key for key in dict.fromkeys(best) if key]


def _lacked(earlier: Search, search: Search) -> set[int]:
    """Candidates that an earlier search did not have."""
    known = {candidate.effect for candidate in earlier.candidates}
    screened = range(search.screened)
    return {number for number in screened if search.candidates[number].effect not in known}
