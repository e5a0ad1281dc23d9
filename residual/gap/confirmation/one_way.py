"""Dry friction where motion goes one way only: a load beside it is more of it, or less."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from residual.gap.confirmation.push import pushed
from residual.gap.fitting.screening import flatten
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.search.pool import Key
from residual.gap.search.sets import SAME_MOTION, Search

Array = NDArray[np.float64]


def may_hold_a_load(search: Search, key: Key, number: int, half: Array) -> bool:
    """Whether a load on its joint moves what more of an effect that holds still does.

    In place of it no load does as well, since it pushes at rest, too, but their sum is all that is
    known of them. Of friction that differs by direction that is so where one may be zero.

    Args:
        search: With the fitted set.
        key: The set.
        number: Its member.
        half: Half the interval of every number of the set, (p,).
    """
    effect, fit = search.candidates[number].effect, search.tried[key]
    joint = search.place(number)
    if not effect.holds_still or not isinstance(search.fitter, SmoothFitter):
        return False
    if joint not in {one.name for one in search.simulator.joints}:
        return False
    load = flatten(pushed(search.fitter, fit, joint), fit.weights)[:, 0]
    knobs = fit.model.knobs
    own = [j for j in np.flatnonzero(fit.model.owner == key.index(number)) if knobs[j].strength]
    more = flatten(fit.by_knob[..., own], fit.weights)
    known = [float(fit.theta[j]) > half[j] for j in own]
    return any(_alike(load, more[:, [i]]) for i in range(len(own))) or (
        not all(known) and _alike(load, more)
    )


def _alike(column: Array, others: Array) -> bool:
    """Whether others make up a column, (n,) of (n, c)."""
    length = float(np.linalg.norm(column))
    made = others @ np.linalg.lstsq(others, column, rcond=1e-9)[0]
    return length > 0 and float(np.linalg.norm(made)) > SAME_MOTION * length
