"""Whether a parameter that follows the motion does the work of what was named beside it.

Where the law itself is another one, as of growth that its own food slows down, two numbers of the
old law imitate it. One of them that changes with a measured state then explains more than both.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from residual.gap.confirmation.constancy import FEW
from residual.gap.confirmation.drift import beside
from residual.gap.data.levels import levels
from residual.gap.fitting.screening import beside_starts
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.search.pool import Key, all_but
from residual.gap.search.sets import Search
from residual.gap.search.significance import tie
from sims.effects.actuator import ActuatorGain
from sims.effects.curve import Curve
from sims.effects.parameter import ParameterChange
from sims.effects.parameter_curve import ParameterCurve

Array = NDArray[np.float64]

#: Part of the loss that it has to leave at most, and beside a remainder, which may favour either.
LESS, CLEARLY_LESS = 0.95, 0.8


def by_another_law(search: Search, key: Key, adequate: bool, close: bool) -> frozenset[int]:
    """Members of a set in whose place a parameter or gain beside them leaves clearly less if it
    changes in proportion to what was measured, those parameters, and curves beside them.

    In the linear picture, so that it is as many numbers for one. What strikes the ground is not
    asked. A parameter that follows a channel comes near to many a law; it is the true one where
    next to nothing is left. Two that do fit whatever acts there, and nothing is sure beside them.

    Args:
        search: With the set, and what is left of it without each member.
        key: The set.
        adequate: Whether it leaves no more than noise.
        close: Whether it leaves little more.
    """
    found = {n for n in key if isinstance(search.candidates[n].effect, ParameterCurve)}
    if len(found) > 1:
        return frozenset(key)
    if close:
        found.clear()
    if not isinstance(search.fitter, SmoothFitter) or len(search.fitter.blocks) < FEW:
        return frozenset(found)
    courses = [level.course for level in levels(search.simulator, search.fitter.samples)]
    for number in key if courses else ():
        for other in all_but(key, number):
            effect = search.candidates[other].effect
            if not isinstance(effect, ParameterChange | ActuatorGain):
                continue
            if {number, other} <= found:
                continue
            least = LESS if adequate else CLEARLY_LESS
            if _explains_more(search, key, number, other, np.stack(courses), least):
                found |= {number, other}
    # A curve follows whatever a law that is not the true one leaves.
    curves = {n for n in key if isinstance(search.candidates[n].effect, Curve)}
    return frozenset(found | curves if found else found)


def _explains_more(
    search: Search, key: Key, number: int, other: int, courses: Array, part: float
) -> bool:
    """Whether a set without a member leaves that part at most if another one changes over one of
    the courses, (k, n)."""
    fitter, rest = search.fitter, all_but(key, number)
    assert isinstance(fitter, SmoothFitter)
    if rest not in search.tried:
        return False
    fit, own = search.tried[rest], search.tried[key].merit
    least = min(part * own, own - tie(search, key, rest))
    moved = beside_starts(fit, fitter.columns(fit, [search.candidates[other]], courses))
    return any(beside(fit, [moved[..., [k]]], fitter.cap).loss < least for k in range(len(courses)))
