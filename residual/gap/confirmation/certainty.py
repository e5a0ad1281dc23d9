"""How sure a chosen effect is: without it, by folds, and numerics; its rivals are in ``rivals``."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.confirmation.claim import Claim, other_than
from residual.gap.confirmation.constancy import creeps, far_apart, on_the_way, whole_size
from residual.gap.confirmation.drift import Drift
from residual.gap.confirmation.feedback import affine, fed_back
from residual.gap.confirmation.few_levels import by_few_levels
from residual.gap.confirmation.following import by_another_law
from residual.gap.confirmation.numerics import STEADY, in_the_limit, survives
from residual.gap.confirmation.one_way import may_hold_a_load
from residual.gap.confirmation.resolution import untimed
from residual.gap.confirmation.rivals import error_ratio, near, where_it_matters
from residual.gap.data.blocks import Blocks
from residual.gap.fitting.contract import Fit
from residual.gap.fitting.intervals import bounded, cut_off, deviations, scatter
from residual.gap.fitting.plausible import doubtful_sensor
from residual.gap.search.comparisons import AT_ONE, no_match
from residual.gap.search.parted import parted
from residual.gap.search.pool import Key, all_but
from residual.gap.search.sets import Search
from residual.gap.search.significance import score, tie
from sims.effects.joint import Cogging

Array = NDArray[np.float64]

#: Standard errors by which forecasts must be worse without the effect.
WORSE = 2.0
#: Times that a number scatters between blocks as noise makes it, where only noise is left, from
#: which on it is not steady: a set that only imitates the truth. Of 85 logs 2.3 at the most. Not
#: where all of it is known within a part of it: parameters a percent off do as much.
SCATTERED, KNOWN = 3.0, 0.25
#: Blocks below which nothing is sure.
TOO_FEW = 4


def claims(
    search: Search,
    key: Key,
    adequate: bool,
    close: bool,
    groups: dict[str, tuple[str, ...]],
    numerics: Sequence[Array],
) -> list[Claim]:
    """What is claimed of every chosen effect, the one that takes off most first.

    Args:
        search: With the chosen set, what is left of it without each member, and exchanges.
        key: The chosen set.
        adequate: Whether it leaves no more than noise, so that chance alone decides.
        close: Whether it leaves little more, so that it is more than an imitation.
        groups: Exact twins by label.
        numerics: Its numbers at half the step and with the other hold, each (p,).
    """
    fit = search.tried[key]
    half = 1.96 * deviations(fit, search.fitter.blocks)
    limits = in_the_limit(fit.theta, numerics)
    scattered = adequate & imitates(fit, search.fitter.blocks, half)
    found, drift, other_law = [], Drift(search), by_another_law(search, key, adequate, close)
    apart, loop = parted(search, key), fed_back(search.fitter.samples)
    for place, number in enumerate(key):
        own = [int(j) for j in np.flatnonzero(fit.model.owner == place)]
        label = search.candidates[number].label
        form, alike, rivals = near(search, key, number, adequate)
        out = {label, *(twin.label for other, twin in apart if other == number)}
        twins = tuple(name for name in groups.get(label, ()) if name not in out)
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
                and (compound or not scattered[strengths].any())
                and (compound or not any(map(far_apart, along.values()))),
                all(
                    survives(fit.theta[j], half[j], [n[j] for n in limits], least)
                    for j in strengths
                ),
                any(cut_off(fit, j) for j in (strengths if compound else own)),
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
                unasked=(key, number) in search.unasked,
                in_a_loop=loop and affine(search, number),
            )
        )
    return sorted(found, key=lambda claim: -claim.share[0])


def imitates(fit: Fit, blocks: Blocks, half: Array) -> NDArray[np.bool_]:
    """Which numbers, (p,), scatter from block to block as those of an imitation do, and are not
    known within a part of themselves.

    Args:
        fit: That leaves noise alone.
        blocks: Of its windows.
        half: Half the width of the numbers' intervals, (p,).
    """
    often = scatter(fit, blocks) > SCATTERED
    return np.asarray(often & (half > KNOWN * np.abs(fit.theta)))


def of_many_orders(search: Search, key: Key, number: int, adequate: bool) -> bool:
    """Whether an effect repeats along a turn beside a remainder, or another one that does there."""
    waves = [n for n in key if isinstance(search.candidates[n].effect, Cogging)]
    there = search.candidates[number].effect.where
    alone = sum(search.candidates[n].effect.where == there for n in waves) == 1
    return number in waves and not (adequate and alone)


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
    gone = 1 - 1 / max(error_ratio(search, without, own, group), 1e-12)
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
