"""Named laws beside the curve by points that could stand in their place."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from residual.gap.answer.confirmed import Answer
from residual.gap.answer.curves import of_its_kind
from residual.gap.answer.left import beside_noise
from residual.gap.confirmation.certainty import CLEARLY
from residual.gap.confirmation.claim import Claim
from residual.gap.search.explain import brought
from residual.gap.search.sets import Key, Search
from sims.effects.base import Effect
from sims.effects.curve import Curve
from sims.effects.parameter_curve import ParameterCurve

#: Part of the squared forecast error that laws leave, less what noise makes, that a curve in their
#: place must leave at most to make them doubtful.
LESS = 0.75


def beside_curves(
    first: Answer, second: Answer, curves: Sequence[Curve]
) -> tuple[Answer, tuple[str, ...]]:
    """The first answer, with every curve that leaves clearly less in place of its laws beside them.

    Laws that come near the true one may be named together, and be needed. What is missing besides
    keeps the curve from taking most of what they leave, but not from forecasting better.

    Args:
        first: With the library's laws.
        second: What was found with curves on offer, too.
        curves: Those.

    Returns:
        The answer, and what is to be said of each such curve.
    """
    effects = first.found.search.candidates
    claims, says = list(first.claims), []
    for curve in curves:
        laws = [n for n in first.key if _is_law(effects[n].effect, curve)]
        if not laws or not _leaves_less(first, second, curve, laws):
            continue
        claims = [
            _beside(one, effects[one.number].effect, curve) if one.number in laws else one
            for one in claims
        ]
        names = " and ".join(effects[n].label for n in laws)
        says.append(
            f"{curve}, a curve by points, forecasts better in place of {names}: to see it, name it "
            "in --effects with all that may be missing but these"
        )
    return dataclasses.replace(first, claims=tuple(claims)), tuple(says)


def beside_varying(first: Answer, second: Answer, curves: Sequence[ParameterCurve]) -> Answer:
    """The first answer, with every parameter that follows a channel beside what it would forecast
    nearly as well in place of, as any rival would; clearly better than that parameter as a number.

    Args:
        first: Without them.
        second: What was found with them on offer, too.
        curves: Those.
    """
    search, again = first.found.search, second.found.search
    numbers = {candidate.effect: n for n, candidate in enumerate(again.candidates)}
    before, claims = search.validated[first.key].squares, []
    for claim in first.claims:
        rivals, effect = [], search.candidates[claim.number].effect
        same = {*claim.twins, *claim.form, *claim.alike}
        # One that moves alike as a constant does as well whatever it follows.
        others = [
            curve for curve in curves
            if claim.sure and curve in numbers and curve.parameter not in same
        ]  # fmt: skip
        for curve in others:
            gone = {numbers.get(effect, -1)}
            gone |= {n for one, n in numbers.items() if curve.contains(one)}
            most = LESS**0.5 if curve.contains(effect) else CLEARLY
            for key in _in_place(search, first.key, again, numbers[curve], gone):
                after = again.validated[key].squares
                if search.currency.error(after) <= most * search.currency.error(before):
                    rivals.append(str(curve))
        claims.append(dataclasses.replace(claim, rivals=(*claim.rivals, *rivals)))
    return dataclasses.replace(first, claims=tuple(claims))


def _is_law(effect: Effect, curve: Curve) -> bool:
    return effect.enters != "parameter" and of_its_kind(curve, effect)


def _leaves_less(first: Answer, second: Answer, curve: Curve, laws: Sequence[int]) -> bool:
    """Whether the best set with a curve in place of laws leaves clearly less than the best with
    them, whatever of other kinds is in either."""
    search, again = first.found.search, second.found.search
    numbers = {candidate.effect: n for n, candidate in enumerate(again.candidates)}
    if curve not in numbers or not brought(search, first.key, again):
        return False
    points, named = numbers[curve], {numbers[search.candidates[n].effect] for n in laws}
    _in_place(search, first.key, again, points, named)
    alike = {points, *(n for effect, n in numbers.items() if _is_law(effect, curve))}
    with_curve = [key for key in again.usable() if alike & set(key) == {points}]
    with_laws = [key for key in again.usable() if alike & set(key) == named]
    if not with_curve:
        return False
    before = search.validated[first.key].squares
    rivals = [before, *(again.validated[key].squares for key in with_laws)]
    before = min(rivals, key=search.currency.error)
    after = min((again.validated[key].squares for key in with_curve), key=search.currency.error)
    gained, error = search.currency.difference(before, after)
    _, least = beside_noise(first, first.key)
    left, now = (search.currency.error(squares) ** 2 - least for squares in (before, after))
    return gained > error and now <= LESS * left


def _in_place(
    search: Search, key: Key, again: Search, points: int, gone: set[int]
) -> tuple[Key, ...]:
    """Fit a set of an earlier search as it is, and with a curve in place of some of its members;
    returns that one if it may be right."""
    for own, theta in brought(search, key, again).items():
        again.add({own: theta})
        start = 0.0 * again.candidates[points].trials[0].values[0]
        fresh, begin = again.merged(own, [(points, start)], drop=tuple(gone))
        again.add({fresh: begin} if again.fits_in(fresh) else {})
        if fresh in again.validated and again.sound(fresh):
            return (fresh,)
    return ()


def _beside(claim: Claim, effect: Effect, curve: Curve) -> Claim:
    """A claim with a curve that may stand in its place: of the same family, its form is open."""
    if curve.family and curve.family == effect.family:
        return dataclasses.replace(claim, form=(*claim.form, str(curve)))
    return dataclasses.replace(claim, rivals=(*claim.rivals, str(curve)))
