"""How sure a chosen effect is: without it, with rivals in its place, by folds, and numerics."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t

from residual.gap.confirmation.claim import Claim, other_than
from residual.gap.confirmation.constancy import creeps, far_apart, on_the_way, whole_size
from residual.gap.confirmation.drift import Drift
from residual.gap.confirmation.few_levels import by_few_levels
from residual.gap.confirmation.following import by_another_law
from residual.gap.confirmation.numerics import STEADY, at_half_step, in_the_limit, survives
from residual.gap.confirmation.one_way import may_hold_a_load
from residual.gap.confirmation.resolution import untimed
from residual.gap.fitting.intervals import bounded, deviations, ended
from residual.gap.fitting.plausible import doubtful_sensor
from residual.gap.search.comparisons import AT_ONE, no_match
from residual.gap.search.exchange import exchanged, split
from residual.gap.search.sets import Key, Search, all_but
from residual.gap.search.significance import BETTER, score, tie
from sims.effects.joint import Cogging

Array = NDArray[np.float64]

#: Forecast error of a rival, over that of the chosen set, that excludes it while a remainder is
#: left: model imperfection of that size may favour either.
CLEARLY = 1.5
#: Of a rival of the same family, which differs in form alone, and how sure that has to be.
FORM, CHANCE = 1.2, 0.975
#: The same from which on it is, whatever part of the data forecasts start from.
HOPELESS = 3.0
#: Standard errors by which forecasts must be worse without the effect.
WORSE = 2.0
#: Blocks below which forms within a family are not told apart, and below which nothing is sure.
FEW, TOO_FEW = 8, 4


def claims(
    search: Search,
    key: Key,
    adequate: bool,
    groups: dict[str, tuple[str, ...]],
    numerics: Sequence[Array],
) -> list[Claim]:
    """What is claimed of every chosen effect, the one that takes off most first.

    Args:
        search: With the chosen set, what is left of it without each member, and exchanges.
        key: The chosen set.
        adequate: Whether it leaves no more than noise, so that chance alone decides.
        groups: Exact twins by label.
        numerics: Its numbers at half the step and with the other hold, each (p,).
    """
    fit = search.tried[key]
    half = 1.96 * deviations(fit, search.fitter.blocks)
    limits = in_the_limit(fit.theta, numerics)
    found, drift, other_law = [], Drift(search), by_another_law(search, key, adequate)
    for place, number in enumerate(key):
        own = [int(j) for j in np.flatnonzero(fit.model.owner == place)]
        label = search.candidates[number].label
        form, alike, rivals = near(search, key, number, adequate)
        twins = tuple(name for name in groups.get(label, ()) if name != label)
        strengths = [j for j in own if fit.model.knobs[j].strength] or own
        compound = search.candidates[number].effect.compound
        least = whole_size(search, key, number)
        numbers = {fit.model.knobs[j].field: bounded(fit, j, half[j], numerics) for j in own}
        along = on_the_way(search, key, number)
        for j, ends in along.items():
            field = fit.model.knobs[j].field
            numbers[field] = dataclasses.replace(numbers[field], along=ends)
        taken = share(search, key, number)
        found.append(
            Claim(
                number,
                numbers,
                other_than(twins, form),
                other_than(twins, alike),
                other_than(twins, rivals),
                twins,
                needed(search, key, number, adequate) and not (adequate and taken[1] < 0),
                all(steady(search, key, j, least) for j in strengths)
                and (compound or not any(map(far_apart, along.values()))),
                all(
                    survives(fit.theta[j], half[j], [n[j] for n in limits], least)
                    for j in strengths
                ),
                any(ended(fit, j) for j in (strengths if compound else own)),
                taken,
                brief=untimed(search, number, fit.theta[own]),
                sensor=not adequate and not twins and of_doubtful_sensor(search, key, place),
                by_fit=by_fit(search, key, number),
                creeps=creeps(search, key, number),
                drifts=not search.candidates[number].effect.creeps
                and drift.does_as_well(key, number),
                one_way=may_hold_a_load(search, key, number, half),
                other_law=number in other_law,
                extreme=key in search.extreme,
                orders=of_many_orders(search, key, number, adequate),
                few_levels=by_few_levels(search, key, number),
            )
        )
    return sorted(found, key=lambda claim: -claim.share[0])


def of_many_orders(search: Search, key: Key, number: int, adequate: bool) -> bool:
    """Whether an effect repeats along a turn beside a remainder, or another one that does there."""
    waves = [n for n in key if isinstance(search.candidates[n].effect, Cogging)]
    there = search.candidates[number].effect.where
    alone = sum(search.candidates[n].effect.where == there for n in waves) == 1
    return number in waves and not (adequate and alone)


def near(
    search: Search, key: Key, number: int, adequate: bool
) -> tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
    """Effects that do nearly as well in place of a chosen one, see ``Claim``."""
    rest, family = all_but(key, number), search.family(number)
    form: list[str] = []
    same: list[str] = []
    others: list[str] = []
    for other, rival in exchanged(search, key, number, nearly=True):
        alike = bool(family) and search.family(other) == family
        label = search.candidates[other].label
        if excluded(search, key, rival, number, adequate, alike):
            continue
        if alike:
            form.append(label)
        elif not adequate and search.same_motion(rest, number, other):
            same.append(label)
        else:
            others.append(label)
    for rival, fresh in split(search, key, number):
        if not excluded(search, key, rival, number, adequate, alike=False):
            akin = [other for other in fresh if family and search.family(other) == family]
            # A set with one of the family says how it acts, not whether.
            form += [search.candidates[other].label for other in akin]
            others += [] if akin else [search.candidates[other].label for other in fresh]
    return tuple(dict.fromkeys(form)), tuple(same), tuple(dict.fromkeys(others))


def excluded(
    search: Search, key: Key, rival: Key, number: int, adequate: bool, alike: bool
) -> bool:
    """Whether a rival with one effect exchanged is out.

    Down to the noise, chance decides, at half the step, too, where that matters: a delay may fit
    what a lag did only because steps are coarse. Of what strikes the ground forecasts have to be
    worse as well, since fits hang on luck in finding start states there. While a remainder is
    left, a rival has to be clearly worse, also from starts that are better known: errors of the
    start fade in a sluggish model otherwise than in a late one. One that differs in form alone
    has to lose at the horizon, beyond chance, and at half of it. What leaves three times as much
    of all data is out, and of another family what has more numbers and fits no better: a store that
    is quickly filled is nothing but more capacity.
    """
    more = search.numbers(rival) > search.numbers(key)
    if more and not alike and search.tried[rival].merit >= search.tried[key].merit:
        return True
    if adequate:
        if search.simulator.has_contacts and search.error(key) >= BETTER * search.error(rival):
            return False
        behind = score(search, rival) - score(search, key)
        return behind > tie(search, key, rival) and not _by_numerics(search, key, rival, behind)
    if no_match(search, rival, key):
        return True
    group = where_it_matters(search, key, number)
    own, its = (search.validated[k] for k in (key, rival))
    worse = _ratio(search, its.squares, own.squares, group)
    if worse > HOPELESS:
        return True
    if worse <= (FORM if alike else CLEARLY):
        return False
    if alike:
        blocks = len(search.fitter.blocks)
        behind, error = search.currency.difference(its.squares, own.squares, group)
        by_chance = behind <= t.ppf(CHANCE, max(blocks - 1, 1)) * error
        return blocks >= FEW and not by_chance and _ratio(search, its.half, own.half, group) > 1.0
    longer = [search.from_longer_leads(k) for k in (rival, key)]
    return _ratio(search, longer[0], longer[1], group) > CLEARLY


def in_plain_form(search: Search, key: Key, claims: Sequence[Claim]) -> Key | None:
    """The set with a plainer form of an effect whose own numbers these data do not tell, if any.

    A law of which a strength may be zero, or a number lies at its bound, is no better than one of
    its family with fewer numbers that does as well.
    """
    for claim in claims:
        own = search.candidates[claim.number]
        strengths = {knob.field for knob in own.knobs if knob.strength}
        told = not any(
            n.at_bound or (field in strengths and n.low <= 0 <= n.high)
            for field, n in claim.numbers.items()
        )
        forms = [
            rival
            for other, rival in exchanged(search, key, claim.number)
            if search.numbers(rival) < search.numbers(key)
            and search.candidates[other].label in claim.form
        ]
        if forms and not told:
            return min(forms, key=lambda rival: (search.numbers(rival), search.error(rival)))
    return None


def _by_numerics(search: Search, key: Key, rival: Key, behind: float) -> bool:
    """Whether a rival is behind at the usual step alone."""
    own = at_half_step(search, key).merit - search.tried[key].merit
    least = tie(search, key, rival)
    if behind > 2 * abs(own) or abs(own) < least:
        return False
    its = at_half_step(search, rival).merit - search.tried[rival].merit
    return behind + its - own <= least


def ratio(search: Search, one: Key, other: Key, group: int) -> float:
    """Forecast error of a set over that of another at a joint."""
    squares = search.validated[one].squares, search.validated[other].squares
    return _ratio(search, *squares, group)


def _ratio(search: Search, one: Array, other: Array, group: int) -> float:
    errors = [search.currency.by_group(squares)[group] for squares in (one, other)]
    return float(errors[0] / max(errors[1], 1e-12))


def where_it_matters(search: Search, key: Key, number: int) -> int:
    """The joint at which forecasts suffer most without an effect."""
    rest = all_but(key, number)
    base = rest if rest in search.validated else ()
    before = search.currency.by_group(search.validated[base].squares)
    after = search.currency.by_group(search.validated[key].squares)
    return int(np.argmax((before - after) / np.maximum(before, 1e-12)))


def needed(search: Search, key: Key, number: int, adequate: bool) -> bool:
    """Whether forecasts are clearly worse without an effect."""
    rest = all_but(key, number)
    if rest not in search.validated:
        return False
    group = where_it_matters(search, key, number)
    without, own = search.validated[rest].squares, search.validated[key].squares
    lost, _ = search.currency.difference(without, own, group)
    if adequate:
        return score(search, rest) - score(search, key) > tie(search, key, rest) and lost > 0
    gone = 1 - 1 / max(_ratio(search, without, own, group), 1e-12)
    if gone <= 0.5 * AT_ONE:
        return False
    clearly = search.currency.clearly(without, own, group, True)
    # Where one block outweighs all others, these have to say so without it.
    return (clearly or search.currency.clearly_elsewhere(without, own, group)) > WORSE


def by_fit(search: Search, key: Key, number: int) -> bool:
    """Whether a set without one of its effects is no match for it."""
    rest = all_but(key, number)
    return rest in search.tried and no_match(search, rest, key)


def steady(search: Search, key: Key, j: int, least: float = 0.0) -> bool:
    """Whether a number has one sign and about one size in every fold.

    Args:
        search: With the set.
        key: The set.
        j: The number.
        least: Size that counts if the number is smaller.
    """
    value, folds = search.tried[key].theta[j], search.validated[key].thetas[:, j]
    return bool((np.abs(folds - value) <= STEADY * max(abs(value), least)).all())


def of_doubtful_sensor(search: Search, key: Key, place: int) -> bool:
    """Whether a member of a set is a sensor that would be wrong as sensors seldom are."""
    fit = search.tried[key]
    effects = fit.model.added(fit.theta)
    return doubtful_sensor(effects[place], search.simulator, search.fitter.samples)


def share(search: Search, key: Key, number: int) -> tuple[float, float, float]:
    """Part of the nominal squared error that an effect takes off, last of all in its set."""
    rest = all_but(key, number)
    base = rest if rest in search.validated else ()
    squares = search.validated
    return search.currency.share(
        squares[base].squares, squares[key].squares, np.random.default_rng(0)
    )
