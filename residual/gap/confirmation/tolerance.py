"""What parameters of the nominal simulator do to an answer if they are off.

No parameter is known exactly, so an effect is certain only if it is needed, and beats its rivals,
also where every parameter may differ by its tolerance.
"""

from __future__ import annotations

import dataclasses
import functools
import time
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.confirmation.claim import Claim
from residual.gap.confirmation.rivals import CLEARLY, where_it_matters
from residual.gap.confirmation.rivals import HOPELESS as NO_MATCH
from residual.gap.confirmation.size import with_size
from residual.gap.confirmation.widening import widened
from residual.gap.fitting.bounded import bounded_step
from residual.gap.fitting.contract import UNCONVERGED, Fit
from residual.gap.fitting.intervals import deviations
from residual.gap.fitting.screening import beside_starts, trials
from residual.gap.fitting.validation import validate
from residual.gap.model.candidates import Candidate, candidates
from residual.gap.model.model import Model
from residual.gap.search import known
from residual.gap.search.exchange import add_without_each, exchanged
from residual.gap.search.pool import Key, all_but
from residual.gap.search.sets import Search
from residual.gap.search.significance import size
from sims.effects.actuator import ActuatorGain
from sims.effects.library import library
from sims.effects.parameter import ParameterChange
from sims.effects.sensor import ScaledSensor

Array = NDArray[np.float64]

#: Rivals that are given another chance, parameters free.
RIVALS = 4
#: Squared residual that linear parameters promise a rival, over that of the chosen set, from which
#: on it is not fitted with them: on a robot's logs the promise was right within a factor of 1.5.
HOPELESS = 10.0
#: Error over that of the chosen set from which on it is clearly larger where much is left.
TWICE = 2.0
#: Part of an effect's work that free parameters do without it, from which on it may be theirs.
WORK = 0.2
#: Parameters that are allowed for, those that matter most.
MOST = 12


def allow_for_parameters(
    search: Search, key: Key, claims: Sequence[Claim], adequate: bool, tolerance: float,
    until: float = np.inf, much_left: bool = False,
) -> list[Claim]:  # fmt: skip
    """The claims with parameters allowed for.

    Args:
        search: With the chosen set, and its members exchanged for rivals.
        key: The chosen set.
        claims: Of its members.
        adequate: Whether only noise is left, so that chance decides.
        tolerance: How well parameters are known, as a share of each.
        until: When to ask no further, on the clock of ``time.process_time``: what was not asked
            is not certain.
        much_left: Whether many times the noise is left: what has no name then is no small thing,
            and may favour what comes near it.
    """
    parameters = allowed(search, tolerance) if claims else []
    if not parameters:
        return list(claims)
    if time.process_time() > until:
        return [dataclasses.replace(claim, unasked=True) for claim in claims]
    add_without_each(search, key)
    beside = calibrated(search, key, parameters)
    left = float((beside.fit.projected**2).sum())
    asked: dict[Key, Calibrated] = {}

    @functools.cache
    def hopeless(other: Key) -> bool:
        """Whether another set is not worth a fit with parameters free."""
        return not search.beside and promised(search, other, parameters) > HOPELESS * left

    def as_good(claim: Claim, other: Key, clearly: float = CLEARLY) -> bool:
        """Whether another set does as well as the chosen one, parameters free beside both."""
        if hopeless(other):
            return False
        its = asked[other] = calibrated(search, other, parameters)
        if adequate:
            more = search.numbers(key) - search.numbers(other)
            # What has more numbers has to fit better for them.
            tie = search.fitter.tie(search.tried[()]) if more >= 0 else 0.0
            price = np.log(size(search)) * more + tie
            return bool(its.fit.merit <= beside.fit.merit + price)
        group = where_it_matters(search, key, claim.number)
        return bool(its.errors[group] <= clearly * beside.errors[group])

    def slight(claim: Claim) -> bool:
        """Whether free parameters do nothing of an effect's work, which is little as it is."""
        without = all_but(key, claim.number)
        if adequate or search.beside or without not in asked:
            return False
        group = where_it_matters(search, key, claim.number)
        own, rest = (search.currency.by_group(search.validated[k].squares) for k in (key, without))
        free = asked[without].errors[group] - beside.errors[group]
        return work(rest[group] - own[group], free) < WORK

    told = []
    for claim in claims:
        late = claim.unasked or time.process_time() > until
        claim = dataclasses.replace(claim, unasked=late)
        if claim.sure:
            as_well = as_good(claim, all_but(key, claim.number), TWICE if much_left else CLEARLY)
            little = as_well and slight(claim)
            claim = dataclasses.replace(claim, calibration=as_well, slight=little)
        if claim.sure:
            rivals = [
                search.candidates[other].label
                for other, rival in excluded_rivals(search, key, claim)
                if as_good(claim, rival)
            ]
            claim = dataclasses.replace(claim, rivals=tuple(dict.fromkeys(rivals)))
        if claim.sure:
            plainer = [
                search.candidates[other].label
                for other, rival in plainer_forms(search, key, claim)
                if as_good(claim, rival)
            ]
            claim = dataclasses.replace(claim, form=(*claim.form, *plainer))
        told.append(claim)

    def certainly_there(claim: Claim) -> bool:
        """Whether nothing comes near without an effect, parameters free."""
        without = all_but(key, claim.number)
        if without not in asked and not search.beside:
            return hopeless(without)
        group = where_it_matters(search, key, claim.number)
        rest = asked[without] if without in asked else calibrated(search, without, parameters)
        return bool(rest.errors[group] > NO_MATCH * beside.errors[group])

    half = 1.96 * deviations(beside.fit, search.fitter.blocks)
    final = []
    for claim in widened(search, key, told, beside.fit, adequate):
        claim = with_size(search, dataclasses.replace(claim, there=certainly_there(claim)))
        own = np.flatnonzero(beside.fit.model.owner == key.index(claim.number))
        sizes = own[search.candidates[claim.number].linear]
        lost = bool(sizes.size) and not (np.abs(beside.fit.theta) > half)[sizes].any()
        if lost and not claim.there:
            claim = dataclasses.replace(claim, calibration=True, slight=False)
        small = within(search, claim, tolerance, adequate)
        final.append(dataclasses.replace(claim, within=small))
    return final


def work(fixed: float, free: float) -> float:
    """Part of what an effect takes off the error that parameters take off in its place.

    Args:
        fixed: What it takes off with parameters as they are.
        free: The same with parameters free.
    """
    return 1 - free / fixed if fixed > 0 else 1.0


def promised(search: Search, key: Key, parameters: Sequence[Candidate]) -> float:
    """Squared residual of a set with free parameters, if everything were linear."""
    chosen = set(search.labels(key))
    free = [candidate for candidate in parameters if candidate.label not in chosen]
    fit, variants = search.tried[key], trials(free)
    columns = search.fitter.columns(fit, free)[..., [v.columns[0] for v in variants]]
    columns /= np.array([variant.trial.values[0, 0] for variant in variants])
    columns = beside_starts(fit, columns)
    rows = np.concatenate([fit.by_knob, columns], axis=2)
    rows = rows.reshape(-1, rows.shape[2])
    knobs = [knob for candidate in free for knob in candidate.knobs]
    low = np.append(fit.model.low - fit.theta, [knob.low for knob in knobs])
    high = np.append(fit.model.high - fit.theta, [knob.high for knob in knobs])
    step = bounded_step(rows.T @ rows, rows.T @ fit.projected.ravel(), low, high)
    return float(((fit.projected.ravel() - rows @ step) ** 2).sum())


def within(search: Search, claim: Claim, tolerance: float, adequate: bool) -> bool:
    """Whether a claim is of what may be off by no more than parameters may be.

    A gain or a scale is a share, as the tolerance is. While a remainder is left, one that is as
    small may make up for any of that.
    """
    effect = search.candidates[claim.number].effect
    if isinstance(effect, ParameterChange):
        size = tolerance * known.size(search, effect.parameter)
    elif isinstance(effect, ActuatorGain | ScaledSensor) and not adequate:
        size = tolerance
    else:
        return False
    (share,) = claim.numbers.values()
    return share.low < size and share.high > -size


def excluded_rivals(search: Search, key: Key, claim: Claim) -> list[tuple[int, Key]]:
    """Effects of other families that were found worse in place of a claimed one, best first.

    Returns:
        At most ``RIVALS`` of those that take a part of the error off: candidate and its set.
    """
    rest = all_but(key, claim.number)
    group = where_it_matters(search, key, claim.number)
    family = search.family(claim.number)
    found = []
    for other, rival in exchanged(search, key, claim.number):
        same = family and search.family(other) == family
        if same or search.candidates[other].label in (*claim.twins, *claim.form):
            continue
        error = search.currency.by_group(search.validated[rival].squares)[group]
        found.append((float(error), other, rival))
    without = search.currency.by_group(search.validated[rest].squares)[group]
    return [(other, rival) for error, other, rival in sorted(found)[:RIVALS] if error < without]


def plainer_forms(search: Search, key: Key, claim: Claim) -> list[tuple[int, Key]]:
    """Laws that are cases of a claimed one, and worse in its place with parameters as they are:
    candidate and its set. A friction that falls a little at speed may be one that does not, and a
    damping a little off."""
    return [
        (other, rival)
        for other, rival in exchanged(search, key, claim.number)
        if search.contains(claim.number, other)
        and search.candidates[other].label not in (*claim.form, *claim.twins)
    ]


def allowed(search: Search, tolerance: float) -> list[Candidate]:
    """Changes of the parameters within their tolerance, of the ones that move forecasts most."""
    simulator = search.simulator
    changes = [e for e in library(simulator) if isinstance(e, ParameterChange)]
    found, reach = [], []
    for candidate in candidates(simulator, changes, search.fitter.samples):
        assert isinstance(candidate.effect, ParameterChange)
        most = tolerance * known.size(search, candidate.effect.parameter)
        (knob,) = candidate.knobs
        if most > 0:
            bounded = dataclasses.replace(
                knob, low=max(knob.low, -most), high=min(knob.high, most), step=0.3 * most,
                known=most / np.sqrt(3),
            )  # fmt: skip
            found.append(dataclasses.replace(candidate, knobs=(bounded,)))
            reach.append(most)
    if len(found) <= MOST:
        return found
    columns = search.fitter.columns(search.nominal, found)
    trials = np.array([candidate.trials[0].values[0, 0] for candidate in found])
    matters = np.linalg.norm(columns, axis=(0, 1)) * np.array(reach) / np.abs(trials)
    return [found[i] for i in np.sort(np.argsort(-matters)[:MOST])]


@dataclasses.dataclass(frozen=True)
class Calibrated:
    """A set beside which all parameters are free within their tolerance.

    Attributes:
        fit: Its fit, the numbers of the set first.
        squares: Mean squared errors of cross-validated forecasts of blocks, (B, m).
        errors: Relative to those of the nominal simulator, by joint, (g,).
    """

    fit: Fit
    squares: Array
    errors: Array


def calibrated(search: Search, key: Key, parameters: Sequence[Candidate]) -> Calibrated:
    """A set fitted with all parameters free within their tolerance."""
    if search.beside:
        squares = search.validated[key].squares
        return Calibrated(search.tried[key], squares, search.currency.by_group(squares))
    chosen = [search.candidates[i] for i in key]
    names = {candidate.label for candidate in chosen}
    free = [candidate for candidate in parameters if candidate.label not in names]
    start = np.append(search.own(key), np.zeros(len(free)))
    model, own = Model(search.simulator, [*chosen, *free]), search.tried[key]
    fit = search.fitter.fit(model, start, own)
    if fit.merit > UNCONVERGED * own.merit:
        # It holds what ``own`` holds, so it did not converge, and would excuse every rival.
        again = search.fitter.resumed(model, start, own)
        fit = again if again.merit < fit.merit else fit
    squares = validate(search.fitter, fit).squares
    return Calibrated(fit, squares, search.currency.by_group(squares))
