"""What parameters of the nominal simulator, and the log's clock, do to an answer if they are off.

No parameter is known exactly, so an effect is certain only if it is needed also where every
parameter may differ by its tolerance, and the interval of a number says how far it may lie off
because they do.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.bounded import bounded_step
from residual.gap.candidates import Candidate, candidates
from residual.gap.confirmation import CLEARLY, Claim, tie, where_it_matters
from residual.gap.fitting import Fit
from residual.gap.intervals import deviations
from residual.gap.model import Model
from residual.gap.result import Number
from residual.gap.search import Key, Search
from residual.gap.significance import size
from residual.gap.validation import validate
from sims.effects.library import library
from sims.effects.parameter import ParameterChange

Array = NDArray[np.float64]

#: How well a parameter is taken to be known, as a share of it.
KNOWN = 0.03
#: Part of the time between samples below which a delay or lag is no more certain than the log's
#: clock: time stamps, and filters in sensors, are as late.
BRIEF = 0.5
#: Errors of a forecast count up to so many times the usual one of the nominal simulator.
BEYOND = 3.0
#: Parameters that are allowed for, those that matter most.
MOST = 12


def allow_for_parameters(
    search: Search, key: Key, claims: Sequence[Claim], adequate: bool, tolerance: float
) -> list[Claim]:
    """The claims with parameters allowed for.

    Args:
        search: With the chosen set.
        key: The chosen set.
        claims: Of its members.
        adequate: Whether only noise is left, so that chance decides.
        tolerance: How well parameters are known, as a share of each.
    """
    parameters = allowed(search, tolerance) if claims else []
    if not parameters:
        return list(claims)
    search.add_without_each(key)
    clock = BRIEF * sample_interval(search)
    claims = [
        dataclasses.replace(claim, brief=any(_is_brief(n, clock) for n in claim.numbers.values()))
        for claim in claims
    ]
    beside = calibrated(search, key, parameters)
    told = []
    for claim in claims:
        if claim.sure:
            without = calibrated(search, tuple(i for i in key if i != claim.number), parameters)
            if adequate:
                price = np.log(size(search)) * len(claim.numbers) + tie(search)
                enough = without.fit.merit <= beside.fit.merit + price
            else:
                group = where_it_matters(search, key, claim.number)
                enough = without.errors[group] <= CLEARLY * beside.errors[group]
            claim = dataclasses.replace(claim, calibration=bool(enough))
        told.append(claim)
    shifts = by_parameters(beside.fit, len(search.tried[key].theta))
    return [widened(search, key, claim, told, shifts) for claim in told]


def sample_interval(search: Search) -> float:
    """Usual time between recorded samples, in s."""
    recorded = search.fitter.samples.recorded
    return float(np.median(np.concatenate([run.durations for run in recorded])))


def _is_brief(number: Number, clock: float) -> bool:
    return number.unit == "s" and 0 < abs(number.value) < clock


def allowed(search: Search, tolerance: float) -> list[Candidate]:
    """Changes of the parameters within their tolerance, of the ones that move forecasts most."""
    simulator = search.simulator
    changes = [e for e in library(simulator) if isinstance(e, ParameterChange)]
    found, reach = [], []
    for candidate in candidates(simulator, changes, search.fitter.samples):
        assert isinstance(candidate.effect, ParameterChange)
        value = simulator.parameters[candidate.effect.parameter].value
        most = tolerance * float(np.max(np.abs(value)))
        (knob,) = candidate.knobs
        if most > 0:
            bounded = dataclasses.replace(
                knob, low=max(knob.low, -most), high=min(knob.high, most), step=0.3 * most
            )
            found.append(dataclasses.replace(candidate, knobs=(bounded,)))
            reach.append(most)
    if len(found) <= MOST:
        return found
    columns = search.fitter.columns(search.tried[()], found)
    trials = np.array([candidate.trials[0].values[0, 0] for candidate in found])
    matters = np.linalg.norm(columns, axis=(0, 1)) * np.array(reach) / np.abs(trials)
    return [found[i] for i in np.sort(np.argsort(-matters)[:MOST])]


@dataclasses.dataclass(frozen=True)
class Calibrated:
    """A set beside which all parameters are free within their tolerance.

    Attributes:
        fit: Its fit, the numbers of the set first.
        errors: Cross-validated forecast errors by joint, (g,).
    """

    fit: Fit
    errors: Array


def calibrated(search: Search, key: Key, parameters: Sequence[Candidate]) -> Calibrated:
    """A set fitted with all parameters free within their tolerance."""
    chosen = [search.candidates[i] for i in key]
    names = {candidate.label for candidate in chosen}
    free = [candidate for candidate in parameters if candidate.label not in names]
    start = np.append(search.tried[key].theta, np.zeros(len(free)))
    fit = search.fitter.fit(Model(search.simulator, [*chosen, *free]), start, search.tried[key])
    squares = validate(search.fitter, fit).squares
    return Calibrated(fit, search.currency.by_group(squares))


def by_parameters(fit: Fit, count: int) -> Array:
    """How far the first numbers of a fit lie off if its last ones do by their tolerance, (count,).

    Errors of the parameters are taken to be independent.
    """
    rows = np.sqrt(fit.weights)[:, None, None] * fit.by_knob
    own, others = rows[..., :count], rows[..., count:]
    scale = np.sqrt(np.maximum((own**2).sum(axis=(0, 1)), 1e-300))
    own = own / scale
    matrix = np.einsum("wri,wrj->ij", own, own)
    right = np.einsum("wri,wrj->ij", own, others)
    most = np.array([knob.high for knob in fit.model.knobs[count:]])
    shifts = np.linalg.pinv(matrix, rcond=1e-12) @ right * most / scale[:, None]
    return np.sqrt((shifts**2).sum(axis=1))


def widened(
    search: Search, key: Key, claim: Claim, claims: Sequence[Claim], shifts: Array
) -> Claim:
    """A claim with intervals that hold with and without its companions that are not certain.

    They hold, too, for the numbers that forecast best. Of a model that is right, those are the
    numbers of the fit; of one that leaves a remainder, each weighs that in its own way.

    Args:
        search: With the chosen set.
        key: The chosen set.
        claim: One of its members.
        claims: All of them.
        shifts: By which each number of the set may lie off as parameters do, (p,).
    """
    sure = {other.number for other in claims if other.sure}
    smaller, theta = search.merged(
        key, (), drop=tuple(i for i in key if i not in sure | {claim.number})
    )
    search.add({smaller: theta})
    fit, alone = search.tried[key], search.tried[smaller]
    best = best_forecasts(search, smaller)
    own = np.flatnonzero(fit.model.owner == key.index(claim.number))
    there = np.flatnonzero(alone.model.owner == smaller.index(claim.number))
    half = 1.96 * deviations(alone, search.fitter.blocks)
    usable = search.sound(smaller)
    numbers: dict[str, Number] = {}
    for j, k in zip(own, there, strict=True):
        knob = fit.model.knobs[j]
        number = claim.numbers[knob.field]
        # In quadrature: errors of the data have nothing to do with those of the parameters.
        low = number.value - np.hypot(number.value - number.low, shifts[j])
        high = number.value + np.hypot(number.high - number.value, shifts[j])
        if usable:
            reach = float(np.hypot(half[k], shifts[j]))
            least, most = sorted((alone.theta[k], best[k]))
            low, high = min(low, least - reach), max(high, most + reach)
        numbers[knob.field] = dataclasses.replace(
            number,
            low=max(float(low), knob.low),
            high=min(float(high), knob.high),
            if_exact=(number.low, number.high),
        )
    return dataclasses.replace(claim, numbers=numbers)


def best_forecasts(search: Search, key: Key) -> Array:
    """Numbers with which a set's forecasts are best in least squares, (p,), a step from its fit."""
    fitter, fit = search.fitter, search.tried[key]
    samples, windows = fitter.samples, fitter.blocks.windows
    seen = samples.seen[windows.index][..., samples.measured]
    usual = np.sqrt(np.nanmean(search.validated[()].foretold.squares, axis=0))
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
