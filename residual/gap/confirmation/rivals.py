"""What would do in place of a chosen effect: rivals that these data do not exclude."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from residual.gap.confirmation.claim import Claim
from residual.gap.confirmation.numerics import at_half_step
from residual.gap.confirmation.settled import settled
from residual.gap.search.comparisons import no_match
from residual.gap.search.exchange import exchanged, split
from residual.gap.search.pool import Key, all_but
from residual.gap.search.sets import Search
from residual.gap.search.significance import BETTER, score, tie

Array = NDArray[np.float64]

#: Forecast error of a rival, over that of the chosen set, that excludes it while a remainder is
#: left: model imperfection of that size may favour either.
CLEARLY = 1.5
#: Of a rival of the same family, which differs in form alone, and how sure that has to be.
FORM, CHANCE = 1.2, 0.975
#: The same from which on it is, whatever part of the data forecasts start from.
HOPELESS = 3.0
#: Blocks below which forms within a family are not told apart.
FEW = 8


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
    worse as well, since fits hang on luck in finding start states there; clearly so of what settles
    from sample to sample, where all hangs on a time constant that nothing shows. While a remainder
    is left, a rival has to be clearly worse, also from starts that are better known: errors of the
    start fade in a sluggish model otherwise than in a late one. One that differs in form alone
    has to lose at the horizon, beyond chance, and at half of it. What leaves three times as much
    of all data is out, and of another family what has more numbers and fits no better: a store that
    is quickly filled is nothing but more capacity.
    """
    more = search.numbers(rival) > search.numbers(key)
    if more and not alike and search.tried[rival].merit >= search.tried[key].merit:
        return True
    group = where_it_matters(search, key, number)
    if adequate:
        if search.simulator.has_contacts and search.error(key) >= BETTER * search.error(rival):
            return False
        if ratio(search, rival, key, group) <= CLEARLY and settled(search, group):
            return False
        behind = score(search, rival) - score(search, key)
        return behind > tie(search, key, rival) and not _by_numerics(search, key, rival, behind)
    if no_match(search, rival, key):
        return True
    own, its = (search.validated[k] for k in (key, rival))
    worse = error_ratio(search, its.squares, own.squares, group)
    if worse > HOPELESS:
        return True
    if worse <= (FORM if alike else CLEARLY):
        return False
    if alike:
        blocks = len(search.fitter.blocks)
        behind, error = search.currency.difference(its.squares, own.squares, group)
        by_chance = behind <= stdtrit(max(blocks - 1, 1), CHANCE) * error
        halfway = error_ratio(search, its.half, own.half, group)
        return blocks >= FEW and not by_chance and halfway > 1.0
    longer = [search.from_longer_leads(k) for k in (rival, key)]
    return error_ratio(search, longer[0], longer[1], group) > CLEARLY


def in_plain_form(search: Search, key: Key, claims: Sequence[Claim]) -> Key | None:
    """The set with a plainer form of an effect whose own numbers these data do not tell, if any.

    A law of which a strength may be zero, or a number lies at its bound, is no better than one of
    its family with fewer numbers that does as well; nor is any law than a plainer one that
    forecasts no worse and fits as well.
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
            and not excluded(search, key, rival, claim.number, adequate=False, alike=True)
        ]
        if told:
            forms = [
                rival
                for rival in forms
                if search.error(rival) <= search.error(key)
                and score(search, rival) <= score(search, key) + tie(search, key, rival)
            ]
        if forms:
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
    return error_ratio(search, *squares, group)


def error_ratio(search: Search, one: Array, other: Array, group: int) -> float:
    """The same of mean squared errors of blocks, each (B, m)."""
    errors = [search.currency.by_group(squares)[group] for squares in (one, other)]
    return float(errors[0] / max(errors[1], 1e-12))


def where_it_matters(search: Search, key: Key, number: int) -> int:
    """The joint at which forecasts suffer most without an effect."""
    rest = all_but(key, number)
    base = rest if rest in search.validated else ()
    before = search.currency.by_group(search.validated[base].squares)
    after = search.currency.by_group(search.validated[key].squares)
    return int(np.argmax((before - after) / np.maximum(before, 1e-12)))
