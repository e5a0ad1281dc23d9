"""Sets in which one effect takes the place of others, reached by continuation.

Effects that stand for each other want other numbers beside them: beside a gain four times too large
friction is four times as large as beside a mass of a quarter. From the numbers of the one set a fit
seldom finds those of the other; little by little it does.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.fitting.screening import beside_starts, flatten
from residual.gap.model.candidates import Candidate
from residual.gap.model.model import Model
from residual.gap.search.exchange import add_without_each
from residual.gap.search.pool import Key
from residual.gap.search.sets import Search

Array = NDArray[np.float64]

#: Parts of the old effect that are there at each step; the first is small, as nothing is known of
#: the way then.
PARTS = (0.95, 0.85, 0.7, 0.55, 0.4, 0.25, 0.12)
#: Part of what an effect does that members of a set do together, from which on it may take over
#: from one of them; and the least part of it that this one does.
IMITATED, SHARE = 0.99, 0.3
#: Forecast error over that of the set up to which the new one is as good.
AS_GOOD = 1.1
#: Such sets that are tried for one set.
MOST = 4


def in_place(
    search: Search, key: Key, gone: int, heir: Candidate, values: Array
) -> tuple[list[Candidate], Array]:
    """A set with another effect in place of a member: what it holds, and its numbers.

    Args:
        search: With the set.
        key: The set, fitted.
        gone: Its member that goes.
        heir: What comes.
        values: Numbers of that.

    Returns:
        The members that stay, the heir, what is free beside every set; their numbers, (p,).
    """
    fit, rest = search.tried[key], [i for i in key if i != gone]
    stay = [fit.theta[fit.model.owner == key.index(i)] for i in rest]
    theta = np.concatenate([*stay, values, fit.theta[search.numbers(key) :]])
    return [*(search.candidates[i] for i in rest), heir, *search.beside], theta


def handed_over(search: Search, key: Key, gone: int, heir: Candidate) -> Array:
    """Numbers from which a set is fitted with one effect in place of a member.

    The member goes in small steps; the numbers of each are begun where a straight line through
    those of the last two leads (secant predictor, the fit as corrector). Source: Allgower and
    Georg, "Introduction to Numerical Continuation Methods" (2003), chapter 2.

    Args:
        search: With the set.
        key: The set, fitted.
        gone: Its member that goes, with strengths.
        heir: What comes.

    Returns:
        The numbers in the order of ``in_place``, (p,).
    """
    fit, simulator, leaving = search.tried[key], search.simulator, search.candidates[gone]
    values = fit.theta[fit.model.owner == key.index(gone)]
    nothing = np.where(heir.linear, 0.0, heir.trials[0].values[0])
    chosen, theta = in_place(search, key, gone, heir, nothing)
    slope, before = np.zeros_like(theta), 1.0
    for part in PARTS:
        left = leaving.bind(np.where(leaving.linear, part * values, values).tolist())
        partly = simulator.with_effects((*simulator.effects, left))
        start = theta + slope * (part - before)
        found = search.fitter.fit(Model(partly, chosen), start).theta
        slope, theta, before = (found - theta) / (part - before), found, part
    return theta - slope * before


def add_handed_over(search: Search, key: Key) -> None:
    """Fit sets in which one effect takes over from a member of a set that it moves like.

    Growing by one effect at a time may end with wrong names that make up for each other, as a motor
    that is stronger and a mass that is larger do for less damping: where the damping takes over
    from the motor, the mass is no longer needed. So each such set is fitted without its other
    members, too.
    """
    reached = search.error(key)
    for number, gone in _heirs(search, key)[:MOST]:
        rest = tuple(i for i in key if i != gone)
        fresh = tuple(sorted((*rest, number)))
        known = fresh in search.tried and search.error(fresh) <= AS_GOOD * reached
        if search.late or not search.fits_in(fresh):
            continue
        if not known:
            theta = handed_over(search, key, gone, search.candidates[number])
            search.fit(fresh, _sorted(search, (*rest, number), theta))
        if search.sound(fresh) and search.error(fresh) <= AS_GOOD * reached:
            add_without_each(search, fresh)


def _sorted(search: Search, order: Sequence[int], theta: Array) -> Array:
    """Numbers of candidates in some order, in that of their key; others that follow are left."""
    sizes = [len(search.candidates[i].knobs) for i in order]
    parts = dict(zip(order, np.split(theta[: sum(sizes)], np.cumsum(sizes)[:-1]), strict=True))
    return np.concatenate([parts[i] for i in sorted(order)])


def _heirs(search: Search, key: Key) -> list[tuple[int, int]]:
    """Effects that move like some of a set together, each with one of those, likest first."""
    fit = search.tried[key]
    others = [
        number
        for number, candidate in enumerate(search.candidates[: search.screened])
        if number not in key and len(candidate.knobs) == 1 and candidate.linear.all()
    ]
    if not key or not others:
        return []
    columns = search.fitter.columns(fit, [search.candidates[number] for number in others])
    flat = flatten(beside_starts(fit, columns), fit.weights)
    own = flatten(fit.by_knob, fit.weights)
    own = own / np.maximum(np.linalg.norm(own, axis=0), 1e-300)
    found, at = [], 0
    for number in others:
        column = flat[:, at] / max(float(np.linalg.norm(flat[:, at])), 1e-300)
        at += sum(len(trial.values) for trial in search.candidates[number].trials)
        parts = np.linalg.lstsq(own, column, rcond=1e-10)[0]
        like = 1 - float(np.sum((column - own @ parts) ** 2))
        if like < IMITATED:
            continue
        for place, member in enumerate(key):
            doing = float(np.abs(parts[fit.model.owner == place]).max())
            if doing > SHARE and search.candidates[member].linear.all():
                found.append((doing, number, member))
    return [(number, member) for _, number, member in sorted(found, key=lambda one: -one[0])]
