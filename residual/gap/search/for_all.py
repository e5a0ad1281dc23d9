"""One effect in place of all that a set holds at one place.

Growing by one effect at a time may end with several that make up one together: a cogging and an
unbalance are a spring as far as a joint turned. What does the work of all of them does not show
where they are missing, as the simulator's path runs away there; it does on the path with them, less
what they do to it.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from residual.gap.fitting.contract import Fit
from residual.gap.fitting.screening import gains, signatures, trials
from residual.gap.search.pool import Key
from residual.gap.search.sets import Proposals, Search

Array = NDArray[np.float64]

#: Effects that are tried in place of all at one place.
MOST = 2
#: Part of what those do that one has to do in the linear picture.
MOSTLY = 0.9


def add_one_for_all(search: Search, key: Key) -> list[Key]:
    """Fit sets in which one effect stands for all members at one place; returns those.

    Args:
        search: Of a system without impacts; what is tried goes there.
        key: A fitted set.
    """
    places: dict[str, list[int]] = {}
    for number in key:
        places.setdefault(search.candidates[number].effect.where, []).append(number)
    several = [tuple(members) for members in places.values() if len(members) > 1]
    if not several:
        return []
    columns = search.fitter.columns(search.tried[key], search.candidates[: search.screened])
    found: list[Key] = []
    for members in several:
        if not search.out_of_time:
            found += _added(search, key, members, columns)
    return found


def _added(search: Search, key: Key, members: Key, columns: Array) -> list[Key]:
    """Sets with one effect in place of some members, from what each adds to the whole set."""
    fit, screened = search.tried[key], search.candidates[: search.screened]
    rest = tuple(number for number in key if number not in members)
    gone = np.isin(fit.model.owner, [key.index(number) for number in members])
    without = _less(fit, gone, search, rest)
    around = signatures(without, trials(screened), columns)
    whole = float(around.residual @ around.residual)
    proposed: Proposals = {}
    for gain in gains(around):
        number = around.variants[gain.variants[0]].candidate
        if gain.value < MOSTLY * whole or len(proposed) == MOST:
            break
        if number in key:
            continue
        fresh, theta = search.merged(key, [(number, gain.values[0])], drop=members)
        if search.numbers(fresh) < search.numbers(key) and search.fits_in(fresh):
            proposed.setdefault(fresh, theta)
    return search.add(proposed)


def _less(fit: Fit, gone: NDArray[np.bool_], search: Search, rest: Key) -> Fit:
    """A fit whose residual holds what some numbers do, without them."""
    strengths = gone & np.array([knob.strength for knob in fit.model.knobs])
    moved = fit.by_knob[..., strengths] @ fit.theta[strengths]
    return dataclasses.replace(
        fit,
        model=search.model(rest),
        theta=fit.theta[~gone],
        projected=fit.projected + moved,
        by_knob=fit.by_knob[..., ~gone],
    )
