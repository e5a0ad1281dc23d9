"""What differs between records: an effect of which every record wants a size of its own.

A number has one value in all records, so that an effect which changed from one record to the next
(another load, a slope up and down, a supply that sagged) helps none of them and is not named. If
it takes much of the error off once each record has its own size, forecasts of blocks that did not
fit that size say so; which effect it is they seldom tell.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.answer.confirmed import Answer
from residual.gap.beside import Unlike
from residual.gap.confirmation.claim import Claim
from residual.gap.fitting.by_group import ByGroup, columns_apart, settled
from residual.gap.fitting.contract import Fit
from residual.gap.fitting.screening import beside_starts, constrained, flatten, trials
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.fitting.validation import by_block, validate
from residual.gap.search.pool import Key
from residual.gap.search.sets import Search
from sims.effects.actuator import ActuatorGain, StaticActuatorEffect
from sims.effects.base import Effect
from sims.effects.curve import Curve
from sims.effects.joint import ConstantLoad
from sims.effects.parameter import ParameterChange
from sims.effects.sensor import ScaledSensor

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Part of the squared error with one size for all, less what noise makes, that sizes by record may
#: leave.
HALF = 0.5
#: Standard errors over blocks by which they have to be better at one joint.
CLEARLY = 3.0
#: Blocks from which a record has a size of its own.
ENOUGH = 2
#: Effects that are asked beside those that were found, and of all that help so many are told.
ASKED, TOLD = 4, 3
#: Error over that of the best one up to which another does nearly as well.
NEARLY = 1.15
#: Part of a size by which it has to differ between records: a law that is a little bent makes other
#: hundredths of a percent of where each was driven.
HARDLY = 0.005


def unlike(answer: Answer) -> tuple[Unlike, ...]:
    """Effects that take much of what is left off with a size of their own in each record.

    Args:
        answer: What was found with one size for all.

    Returns:
        Best first; none of a single record, where only noise is left, or if records agree.
    """
    search, key = answer.found.search, answer.key
    fitter = search.fitter
    if not isinstance(fitter, SmoothFitter):
        return ()
    names, group = _records(fitter)
    if len(names) < 2 or answer.left.adequate:
        return ()
    noise = answer.found.by_noise(key)
    found = [
        _asked(search, key, base, number, names, group, noise)
        # One size for all may have led to effects that only make the best of it.
        for base in dict.fromkeys([key, ()])
        for number in _worth(search, base, group)
    ]
    helping = sorted((pair for pair in found if pair), key=lambda pair: pair[0])
    told: dict[str, Unlike] = {}
    for error, one in helping:
        if error <= NEARLY * helping[0][0]:
            told.setdefault(one.label, one)
    return tuple(told.values())[:TOLD]


def explain_most(differ: Sequence[Unlike]) -> bool:
    """Whether most of the gap has a name with sizes by record, see ``unlike``: a load in one of
    them makes that one stand out."""
    return any(one.share > HALF for one in differ)


def stands_for(answer: Answer, claim: Claim, differ: Sequence[Unlike]) -> bool:
    """Whether what was named may stand for an effect that differs between records.

    Where one does better alone, all that was named may. A curve may anyway: records that reach
    differently far have points of it to themselves. So may the law of an input where a push
    differs: records driven otherwise tell a law by what parts them.

    Args:
        answer: What was found with one size for all.
        claim: On one of its effects.
        differ: See ``unlike``.
    """
    search = answer.found.search
    effect = search.candidates[claim.number].effect
    curve, law = isinstance(effect, Curve), isinstance(effect, StaticActuatorEffect)
    pushes = {c.label for c in search.candidates if c.effect.family == ConstantLoad.family}
    return any(one.instead or curve or (law and one.label in pushes) for one in differ)


def _records(fitter: SmoothFitter) -> tuple[tuple[str, ...], Integers]:
    """Names of the records with data enough, and the record of every window, (W,), by number;
    all others count as one more."""
    blocks = fitter.blocks
    run = blocks.windows.run
    enough = [r for r in np.unique(run) if len(np.unique(blocks.block[run == r])) >= ENOUGH]
    group = np.full(len(run), len(enough))
    for number, r in enumerate(enough):
        group[run == r] = number
    return tuple(fitter.samples.names[r] for r in enough), group


def _worth(search: Search, key: Key, group: Integers) -> list[int]:
    """Members of a set, and the candidates that take most off in the linear picture."""
    fit = search.tried[key]
    screened = search.candidates[: search.screened]
    columns = beside_starts(fit, search.fitter.columns(fit, screened))
    residual = flatten(fit.projected, fit.weights)
    gains: dict[int, float] = {}
    for variant in trials(screened):
        if len(variant.columns) != 1 or variant.candidate in key:
            continue
        apart = columns_apart(columns[..., list(variant.columns)], group)
        rows = flatten(np.concatenate([fit.by_knob, apart], axis=2), fit.weights)
        sides = np.append(
            np.zeros(len(fit.theta), bool), np.repeat(variant.trial.one_sided, apart.shape[2])
        )
        gain, _ = constrained(rows, residual, sides)
        gains[variant.candidate] = max(gain, gains.get(variant.candidate, 0.0))
    return [*key, *sorted(gains, key=lambda number: -gains[number])[:ASKED]]


def _asked(
    search: Search,
    key: Key,
    base: Key,
    number: int,
    names: tuple[str, ...],
    group: Integers,
    noise: Array,
) -> tuple[float, Unlike] | None:
    """The error of forecasts with a size of its own in each record, and these sizes.

    None if that is not clearly better than one size for all, and than what was found.

    Args:
        search: With the fitted sets ``key`` and ``base``.
        key: What was found.
        base: What the effect is asked beside.
        number: The effect that is asked about.
        names: Records with data enough, and ``group``, the record of every window, (W,).
        noise: Mean squared errors of blocks by noise alone, (B, m).
    """
    fitter, candidate = search.fitter, search.candidates[number]
    assert isinstance(fitter, SmoothFitter)
    fit = search.tried[base] if number in base else _with(search, base, number)
    (own,) = np.flatnonzero([c is candidate for c in fit.model.chosen])
    places = np.flatnonzero(fit.model.owner == own)
    if len(places) != 1:  # of several numbers a record tells too little
        return None
    place = int(places[0])
    blocks = fitter.blocks
    without = [blocks.fold_of_window != fold for fold in range(blocks.folds)]
    which = blocks.fold_of_window * (group.max() + 1) + group

    def squares_of(found: ByGroup) -> Array:
        thetas = np.concatenate([found.step(rows) for rows in without])
        return by_block(fitter.foretell(fit.model, thetas, which, fit).squares, blocks)

    own_sizes = ByGroup.of(fit, place, group)
    apart = squares_of(own_sizes)
    others = [search.validated[key].squares]
    if number not in base:
        others.append(validate(fitter, fit).squares)
    currency = search.currency
    error, least = currency.error(apart), currency.error(noise) ** 2
    for squares in others:
        left = currency.error(squares) ** 2 - least
        surely = max(currency.clearly(squares, apart, g) for g in range(len(currency.groups)))
        if error**2 - least > HALF * left or surely < CLEARLY:
            return None
    further = settled(fitter, own_sizes)
    if further is not own_sizes and currency.error(again := squares_of(further)) <= error:
        own_sizes, apart, error = further, again, currency.error(again)
    sizes = own_sizes.step(np.ones(len(group), bool))[: len(names), place]
    usual = _usual(search, candidate.effect)
    if np.ptp(sizes) < HARDLY * np.abs(usual + sizes).max():
        return None
    by_record = dict(zip(names, map(float, sizes), strict=True))
    taken, *_ = currency.share(search.before.squares, apart, np.random.default_rng(0))
    knob, effect = candidate.knobs[0], candidate.effect
    return error, Unlike(
        effect.name, effect.where, knob.field, knob.unit, by_record, taken, instead=base != key
    )


def _usual(search: Search, effect: Effect) -> float:
    """What a number of an effect is added to: a parameter's value, one for a factor, or nothing."""
    if isinstance(effect, ParameterChange):
        return float(search.simulator.parameters[effect.parameter].value)
    return float(isinstance(effect, ActuatorGain | ScaledSensor))


def _with(search: Search, key: Key, number: int) -> Fit:
    """A set and one candidate more, fitted with one size for all."""
    larger = tuple(sorted((*key, number)))
    if larger in search.tried:
        return search.tried[larger]
    _, theta = search.merged(key, [(number, 0.1 * search.candidates[number].trials[0].values[0])])
    theta = np.append(theta, search.tried[key].theta[search.numbers(key) :])
    return search.fitter.fit(search.model(larger), theta, search.tried[key])
