"""Named laws whose form is open: the data reject it, or it is rare beside much that is left."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence

from residual.gap.answer.confirmed import Answer, much
from residual.gap.answer.curves import over_the_log
from residual.gap.answer.laws import LESS, is_law, open_to
from residual.gap.answer.left import much_is_left, named_of
from residual.gap.confirmation.drift import beside
from residual.gap.confirmation.tolerance import allowed, calibrated
from residual.gap.fitting.contract import Fit
from residual.gap.fitting.screening import beside_starts
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.model.candidates import candidates
from residual.gap.search.significance import price
from sims.effects.base import Effect
from sims.effects.curve import Curve
from sims.effects.library import curves_in


def of_open_form(answer: Answer, offered: Sequence[Curve], tolerance: float) -> Answer:
    """The answer, with every curve by points beside its laws that takes off what no chance does.

    A law of another form may leave so little that curves are not asked for, and whoever leaves
    laws out is not offered the curves of which they are cases. What the points of one take off
    beside the law, in the linear picture, is a test of lack of fit, as of a straight line by a
    polynomial: beyond the price of so many numbers, a quarter of what noise does not make, and
    beside parameters that are off within their tolerance, too.

    Args:
        answer: What was found.
        offered: Curves that are asked for where much is left, and then no matter of this test.
        tolerance: How well the simulator's parameters are known, as a share of each.
    """
    search, key = answer.found.search, answer.key
    if not isinstance(search.fitter, SmoothFitter):
        return answer
    asked = offered if much_is_left(answer) else ()
    claims, named = list(answer.claims), {n: search.candidates[n].effect for n in key}

    @functools.cache
    def free() -> Fit:
        return calibrated(search, key, allowed(search, tolerance)).fit

    for curve in curves_in(search.simulator):
        laws = [n for n, one in named.items() if is_law(one, curve) and not isinstance(one, Curve)]
        if curve in asked or not laws:
            continue
        if not _rejects(answer, search.fitter, search.tried[key], curve):
            continue
        if _rejects(answer, search.fitter, free(), curve):
            claims = open_to(curve, claims, laws, search)
    return dataclasses.replace(answer, claims=tuple(claims))


def rare_beside_much(answer: Answer, further: Sequence[Effect]) -> frozenset[int]:
    """What was named of the effects that are rarer than the library, where what is left is many
    times the noise.

    There are many of these, each asked for because nothing else took most of what was left. One
    that is there leaves little: of 36 such names that were certain and right on other people's
    logs none left ten times the noise.

    Args:
        answer: What was found.
        further: Those effects.
    """
    return frozenset(named_of(answer, further) if much(answer) else ())


def _rejects(answer: Answer, fitter: SmoothFitter, fit: Fit, curve: Curve) -> bool:
    """Whether a curve beside what was named takes off what chance does not."""
    search, simulator = answer.found.search, answer.found.search.simulator
    own = beside(fit, [], fitter.cap).loss
    noise = own / answer.left.ratio**2
    for points in candidates(simulator, over_the_log(curve, fitter, simulator), fitter.samples):
        moved = beside_starts(fit, fitter.columns(fit, [points]))
        by_chance = len(points.knobs) * price(search, own)
        most = min(own - by_chance, noise + LESS * (own - noise))
        if beside(fit, [moved], fitter.cap).loss < most:
            return True
    return False
