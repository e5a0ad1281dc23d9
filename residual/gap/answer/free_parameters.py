"""Parameters that are a little off may hide what is missing: when to look again with them free."""

from __future__ import annotations

import numpy as np

from residual.gap.answer.answer import summed_up, within_noise
from residual.gap.answer.confirmed import Answer
from residual.gap.confirmation.tolerance import allowed, calibrated
from residual.gap.fitting.intervals import at_bound
from residual.gap.model.candidates import Candidate
from residual.gap.search.comparisons import takes_off
from residual.gap.search.explain import FOOTNOTE
from residual.gap.search.known import size
from sims.effects.parameter import ParameterChange


def worth_freeing(answer: Answer, tolerance: float) -> list[Candidate]:
    """Parameters within their tolerance, if they hide something or explain much of what is left.

    They do where nothing could be named, though forecasts err by more than noise, or where they
    take a material part of the error off, free beside what was named. Parameters that were named
    are none of them, nor those that were chosen, though too few data tell of them: they may be off
    by more; but one that was named within its tolerance is no more than the others are.

    Args:
        answer: What was found with all parameters at their values.
        tolerance: How well they are known, as a share of each.
    """
    search, key = answer.found.search, answer.key
    left = answer.left
    if not tolerance or left.adequate or left.ratio <= FOOTNOTE:
        return []
    if not key and within_noise(summed_up(answer)):
        return []
    beyond = tuple(number for number in key if not _within(answer, number, tolerance))
    named = {*search.labels(beyond), *search.labels(tuple(set(answer.found.key) - set(key)))}
    free = [one for one in allowed(search, tolerance) if one.label not in named]
    if not free or not key:
        return free
    squares = calibrated(search, key, free).squares
    return free if takes_off(search.currency, search.validated[key].squares, squares) else []


def _within(answer: Answer, number: int, tolerance: float) -> bool:
    """Whether a member of the answer is a parameter that is off by no more than its tolerance."""
    search, key = answer.found.search, answer.key
    fit = search.tried[key]
    effect = fit.model.added(fit.theta)[key.index(number)]
    if not isinstance(effect, ParameterChange):
        return False
    return bool(abs(effect.change) <= tolerance * size(search, effect.parameter))


def better(second: Answer, first: Answer) -> bool:
    """Whether an answer with parameters free forecasts materially better than one without.

    Where nothing is named beside them, most parameters must lie inside their tolerance: what pulls
    them all to its end is something else.
    """
    search = first.found.search
    if not second.key and _pinned(second) > 0.5:
        return False
    before = search.validated[first.key].squares
    after = second.found.search.validated[second.key].squares
    gained, error = search.currency.difference(before, after)
    return gained > error and takes_off(search.currency, before, after)


def _pinned(answer: Answer) -> float:
    """Share of the free parameters that lie at an end of their tolerance."""
    search = answer.found.search
    fit, first = search.tried[answer.key], search.numbers(answer.key)
    return float(np.mean([at_bound(fit, j) for j in range(first, len(fit.theta))]))
