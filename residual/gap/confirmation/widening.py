"""Intervals of an answer's numbers, with all that they rest on allowed to be off."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence, Set

import numpy as np
from numpy.typing import NDArray

from residual.gap.confirmation.claim import Claim
from residual.gap.confirmation.drift import Drift
from residual.gap.confirmation.resolution import below_a_step, untimed
from residual.gap.confirmation.rivals import CLEARLY, HOPELESS, ratio, where_it_matters
from residual.gap.fitting.bounded import bounded_step
from residual.gap.fitting.contract import Fit
from residual.gap.fitting.intervals import deviations
from residual.gap.result import Number
from residual.gap.search.exchange import exchanged
from residual.gap.search.pool import Key, all_but
from residual.gap.search.sets import Search
from sims.effects.curves import StateCurve

Array = NDArray[np.float64]

#: Errors of a forecast count up to so many times the usual one of the nominal simulator.
BEYOND = 3.0
#: Part of the loss of the chosen set from which on a larger one fits much better.
HALF = 0.5
#: Times as wide that intervals are while a remainder is left. No model is quite right then, and
#: without it 441 of 491 (90 %) held the truth where 95 % are told (docs/dirty-world.md, seeds 0
#: to 3 and 11).
MISFIT = 1.2


def widened(
    search: Search, key: Key, claims: Sequence[Claim], beside: Fit, adequate: bool
) -> list[Claim]:
    """The claims with intervals that hold with and without companions that are not certain.

    They hold, too, for the numbers that forecast best. Of a model that is right, those are the
    numbers of the fit; of one that leaves a remainder, each weighs that in its own way.

    Args:
        search: With the chosen set.
        key: The chosen set.
        claims: Of its members.
        beside: The set fitted with all parameters free within their tolerance.
        adequate: Whether only noise is left. Data that leave a remainder, and those of what strikes
            the ground, are not believed what they say of parameters, so all may be off by their
            tolerance then.
    """
    adequate = adequate and not search.simulator.has_contacts
    sure = {claim.number for claim in claims if claim.sure or vital(search, key, claim)}
    if adequate:
        middle, half = beside.theta, 1.96 * deviations(beside, search.fitter.blocks)
        # What parameters may stand in for stays: they are free in the fit beside.
        sure |= {c.number for c in claims if dataclasses.replace(c, calibration=False).sure}
    else:
        middle, own = search.own(key), 1.96 * deviations(search.tried[key], search.fitter.blocks)
        half = np.hypot(own[: len(middle)], by_parameters(beside, len(middle)))
    freed = np.stack([middle - half, middle + half], axis=1)
    forecast_best = functools.cache(lambda smaller: best_forecasts(search, smaller))
    drifts = [] if adequate else Drift(search).sizes(key)
    told = []
    for claim in claims:
        for smaller in _without_the_unsure(search, key, claim, sure):
            best = forecast_best(smaller) if search.sound(smaller) else None
            claim = _widened(search, key, claim, freed, smaller, best)
        claim = _beside_rivals(search, key, claim, claims)
        claim = _on_the_way(_beside_drifts(search, key, claim, drifts))
        told.append(_resolved(search, claim if adequate else _of_a_misfit(search, key, claim)))
    return told


def _resolved(search: Search, claim: Claim) -> Claim:
    """A claim that says so if it may be a time too short for the log's own clock, or a zero that is
    off by less than a step of its sensor."""
    knobs = search.candidates[claim.number].knobs
    least = np.array([max(claim.numbers[knob.field].low, 0.0) for knob in knobs])
    return dataclasses.replace(
        claim,
        brief=claim.brief or untimed(search, claim.number, least),
        within_step=below_a_step(search, claim.number, claim.numbers),
    )


def _of_a_misfit(search: Search, key: Key, claim: Claim) -> Claim:
    """A claim with intervals ``MISFIT`` times as wide, within the bounds of its numbers."""
    model, numbers = search.tried[key].model, {}
    for j in np.flatnonzero(model.owner == key.index(claim.number)):
        knob = model.knobs[j]
        n = claim.numbers[knob.field]
        low, high = (n.value + MISFIT * (end - n.value) for end in (n.low, n.high))
        numbers[knob.field] = dataclasses.replace(
            n, low=max(low, knob.low), high=min(high, knob.high)
        )
    return dataclasses.replace(claim, numbers=numbers)


def _beside_rivals(search: Search, key: Key, claim: Claim, claims: Sequence[Claim]) -> Claim:
    """A claim with intervals that hold, too, with rivals in place of its companions, in larger sets
    that fit much better and tell its size, but for those in which another law of its kind has a
    part of its work, and without a curve along a state, which is no law and takes up whatever
    happens while the state is there."""
    others = [
        larger
        for larger in _larger(search, key)
        if not any(_of_one_kind(search, claim.number, number) for number in set(larger) - set(key))
    ]
    for companion in claims:
        if companion.number == claim.number:
            continue
        without = all_but(key, companion.number)
        curved = isinstance(search.candidates[companion.number].effect, StateCurve)
        if curved and without in search.tried and search.sound(without):
            others.append(without)
        instead = {*companion.form, *companion.alike, *companion.rivals}
        others += [
            rival
            for other, rival in exchanged(search, key, companion.number)
            if search.candidates[other].label in instead
        ]
    numbers, own = dict(claim.numbers), search.tried[key]
    half = 1.96 * deviations(own, search.fitter.blocks)[own.model.owner == key.index(claim.number)]
    for other in others:
        fit = search.tried[other]
        there = np.flatnonzero(fit.model.owner == other.index(claim.number))
        known = 1.96 * deviations(fit, search.fitter.blocks)[there]
        for j, reach, told in zip(there, half, known, strict=True):
            knob, value = fit.model.knobs[j], float(fit.theta[j])
            n = numbers[knob.field]
            if set(key) < set(other) and abs(value - n.value) <= told:
                continue  # it does not tell: friction by direction beside a zero that is a push
            numbers[knob.field] = dataclasses.replace(
                n,
                low=min(n.low, max(value - reach, knob.low)),
                high=max(n.high, min(value + reach, knob.high)),
            )
    return dataclasses.replace(claim, numbers=numbers)


def _beside_drifts(search: Search, key: Key, claim: Claim, drifts: Sequence[Array]) -> Claim:
    """A claim with intervals that hold the numbers of the set beside pushes that drift, (p,)."""
    fit, numbers = search.tried[key], dict(claim.numbers)
    half = 1.96 * deviations(fit, search.fitter.blocks)
    for j in np.flatnonzero(fit.model.owner == key.index(claim.number)):
        knob = fit.model.knobs[j]
        n = numbers[knob.field]
        ends = [
            float(np.clip(t[j] + s * half[j], knob.low, knob.high)) for t in drifts for s in (-1, 1)
        ]
        numbers[knob.field] = dataclasses.replace(
            n, low=min([n.low, *ends]), high=max([n.high, *ends])
        )
    return dataclasses.replace(claim, numbers=numbers)


def _on_the_way(claim: Claim) -> Claim:
    """A claim with intervals that hold what its numbers are on the way along the records."""
    numbers = {
        field: n
        if n.along is None
        else dataclasses.replace(n, low=min(n.low, *n.along), high=max(n.high, *n.along))
        for field, n in claim.numbers.items()
    }
    return dataclasses.replace(claim, numbers=numbers)


def _larger(search: Search, key: Key) -> list[Key]:
    """Sets that contain the chosen one, leave half of its loss, and forecast no worse than an
    imperfect model may.

    They have more numbers than forecasts bear out, but some of them may well be right, and then the
    numbers of the chosen set are not.
    """
    fit, error = search.tried[key].merit, search.error(key)
    return [
        larger
        for larger in search.usable()
        if set(key) < set(larger)
        and search.tried[larger].merit <= HALF * fit
        and search.error(larger) <= CLEARLY * error
    ]


def _of_one_kind(search: Search, one: int, other: int) -> bool:
    """Whether two laws at one place are both dry friction, say, or one is a case of the other."""
    first, second = search.candidates[one].effect, search.candidates[other].effect
    kinds = {(effect.where, effect.subfamily) for effect in (first, second)}
    alike = len(kinds) == 1 and bool(first.subfamily)
    return alike or search.contains(one, other) or search.contains(other, one)


def vital(search: Search, key: Key, claim: Claim) -> bool:
    """Whether nothing comes near without an effect, so that it or a rival of it is there."""
    rest = all_but(key, claim.number)
    if rest not in search.validated or claim.bounded or claim.calibration:
        return False
    group = where_it_matters(search, key, claim.number)
    return ratio(search, rest, key, group) > HOPELESS


def _without_the_unsure(search: Search, key: Key, claim: Claim, sure: Set[int]) -> list[Key]:
    """Sets of a claim without its companions that are not certain: without all of them; where that
    leaves many times as much, as without two that may each stand for the other, without each."""
    gone = [number for number in key if number not in sure | {claim.number}]
    smaller, theta = search.merged(key, (), drop=tuple(gone))
    search.add({smaller: theta})
    group = where_it_matters(search, key, claim.number)
    if len(gone) < 2 or not ratio(search, smaller, key, group) > HOPELESS:
        return [smaller]
    found = dict(search.merged(key, (), drop=(number,)) for number in gone)
    search.add(found)
    return list(found)


def _widened(
    search: Search, key: Key, claim: Claim, freed: Array, smaller: Key, best: Array | None
) -> Claim:
    """One claim, see ``widened``.

    Args:
        search, key, claim: As there.
        freed: Intervals of the set's numbers with all parameters free, (p, 2).
        smaller: The set without companions that are not certain, see ``_without_the_unsure``.
        best: Numbers with which that forecasts best, if it is sound.
    """
    fit, alone = search.tried[key], search.tried[smaller]
    own = np.flatnonzero(fit.model.owner == key.index(claim.number))
    there = np.flatnonzero(alone.model.owner == smaller.index(claim.number))
    half = 1.96 * deviations(alone, search.fitter.blocks)
    numbers: dict[str, Number] = {}
    for j, k in zip(own, there, strict=True):
        knob = fit.model.knobs[j]
        number = claim.numbers[knob.field]
        low, high = min(number.low, freed[j, 0]), max(number.high, freed[j, 1])
        if best is not None:
            reach = max(float(half[k]), 0.5 * float(np.ptp(freed[j])))
            least, most = sorted((alone.theta[k], best[k]))
            low, high = min(low, least - reach), max(high, most + reach)
        numbers[knob.field] = dataclasses.replace(
            number,
            low=max(float(low), knob.low),
            high=min(float(high), knob.high),
            if_exact=number.if_exact or (number.low, number.high),
        )
    return dataclasses.replace(claim, numbers=numbers)


def by_parameters(fit: Fit, count: int) -> Array:
    """How far the first numbers of a fit lie off if its last ones do by their tolerance, (count,).

    Errors of the parameters are taken to be independent.
    """
    rows = fit.told.by_knob
    own, others = rows[..., :count], rows[..., count:]
    scale = np.sqrt(np.maximum((own**2).sum(axis=(0, 1)), 1e-300))
    own = own / scale
    matrix = np.einsum("wri,wrj->ij", own, own)
    right = np.einsum("wri,wrj->ij", own, others)
    most = np.array([max(knob.high, -knob.low) for knob in fit.model.knobs[count:]])
    shifts = np.linalg.pinv(matrix, rcond=1e-12) @ right * most / scale[:, None]
    return np.sqrt((shifts**2).sum(axis=1))


def best_forecasts(search: Search, key: Key) -> Array:
    """Numbers with which a set's forecasts are best in least squares, (p,), a step from its fit."""
    fitter, fit = search.fitter, search.tried[key]
    samples, windows = fitter.samples, fitter.blocks.windows
    seen = samples.seen[windows.index][..., samples.measured]
    usual = np.sqrt(np.nanmean(search.before.foretold.squares, axis=0))
    usual = np.where(usual > 0, usual, np.inf)  # of a channel that is hardly ever measured
    everywhere = np.zeros(len(windows), np.int64)

    def errors(theta: Array) -> Array:
        shown = fitter.foretell(fit.model, theta[None], everywhere, fit).shown
        wrong = np.where(windows.inside[..., None], (seen - shown) / usual, 0.0)
        return np.nan_to_num(np.clip(wrong, -BEYOND, BEYOND)).ravel()

    theta, step = fit.theta, np.maximum(0.02 * np.abs(fit.theta), 0.1 * fit.model.step)
    step = np.where(theta + step > fit.model.high, -step, step)
    here = errors(theta)
    slopes = [(errors(theta + np.eye(len(theta))[j] * h) - here) / h for j, h in enumerate(step)]
    slope = np.stack(slopes, axis=1)
    low, high = fit.model.low - theta, fit.model.high - theta
    return theta + bounded_step(slope.T @ slope, -slope.T @ here, low, high)
