"""Named laws beside the curve by points that could stand in their place."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Collection, Sequence

from residual.gap.answer.confirmed import Answer
from residual.gap.answer.curves import of_its_kind
from residual.gap.answer.left import beside_noise
from residual.gap.confirmation.claim import Claim
from residual.gap.confirmation.rivals import CLEARLY
from residual.gap.search.earlier import brought
from residual.gap.search.pool import Key
from residual.gap.search.sets import Search
from sims.effects.base import Effect
from sims.effects.curve import Curve
from sims.effects.parameter_curve import ParameterCurve

#: Part of the squared forecast error that laws leave, less what noise makes, that a curve in their
#: place must leave at most to make them doubtful.
LESS = 0.75
#: Forecast error of a curve of another kind, over that of the effect in whose place it stands.
AS_GOOD = 1.0


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
        laws = [n for n in first.key if is_law(effects[n].effect, curve)]
        if not laws or not _leaves_less(first, second, curve, laws):
            continue
        claims = open_to(curve, claims, laws, first.found.search)
        names = " and ".join(effects[n].label for n in laws)
        says.append(
            f"{curve}, a curve by points, forecasts better in place of {names}: to see it, ask "
            f"with --effects library {curve}"
        )
    return dataclasses.replace(first, claims=tuple(claims)), tuple(says)


def beside_others(
    first: Answer, second: Answer, curves: Sequence[Curve], late: Callable[[], bool]
) -> Answer:
    """The first answer, with every curve that would forecast nearly as well in place of what is
    certain among its rivals.

    A parameter that follows a channel is one as any other effect is; clearly better it has to be
    than that parameter as a number, or what is one of its cases. A curve of another kind has more
    numbers, and is one if it forecasts as well. Of its own kind it is one in place of several laws
    that have as many numbers; otherwise see ``beside_curves``. What the whole answer with curves
    does without, and forecasts as well, has them for rivals, too.

    Args:
        first: Without them.
        second: What was found with them on offer, too.
        curves: Those.
        late: Whether there is no time to fit more.
    """
    search, again = first.found.search, second.found.search
    numbers, own = _numbers(again), search.error(first.key)
    sure = [claim for claim in first.claims if claim.sure]
    found: dict[int, list[str]] = {claim.number: [] for claim in first.claims}
    for curve in curves if sure else ():
        alone = [((one.number,), _most(curve, one, search)) for one in sure]
        for group, most in (*alone, (_together(curve, search, first.key), CLEARLY)):
            if not (group and most and curve in numbers) or late():
                continue
            gone = {numbers.get(search.candidates[n].effect, -1) for n in group}
            gone |= {n for one, n in numbers.items() if curve.contains(one)}
            for key in _in_place(search, first.key, again, numbers[curve], gone):
                after = again.validated[key].squares
                if search.currency.error(after) <= most * own:
                    for number in group:
                        found[number].append(str(curve))
    chosen = {again.candidates[n].effect for n in second.key}
    without = [n for n in first.key if search.candidates[n].effect not in chosen]
    its = search.currency.error(again.validated[second.key].squares)
    claims: Sequence[Claim] = first.claims
    for curve in curves if its <= AS_GOOD * own else ():
        if curve in chosen and not isinstance(curve, ParameterCurve):
            claims = open_to(curve, claims, without, search)
    return dataclasses.replace(
        first,
        claims=tuple(
            dataclasses.replace(one, rivals=_with(one.rivals, *found[one.number])) for one in claims
        ),
    )


def beside_further(
    first: Answer, second: Answer, further: Sequence[Effect], late: Callable[[], bool]
) -> Answer:
    """The first answer, with every rarer effect that does nearly as well in place of what is
    certain among its rivals, as any effect of the library is; in place of all that was named, too,
    if it has no more numbers.

    Args:
        first: Without them.
        second: What was found with them on offer, too.
        further: Those.
        late: Whether there is no time to fit more.
    """
    search, again = first.found.search, second.found.search
    numbers, most = _numbers(again), CLEARLY * search.error(first.key)
    claims: Sequence[Claim] = first.claims
    sure = [claim.number for claim in first.claims if claim.sure]
    for effect in further if sure else ():
        if effect not in numbers:
            continue
        few = len(again.candidates[numbers[effect]].knobs) <= search.numbers(first.key)
        for group in (*((number,) for number in sure), *([first.key] if few else [])):
            if late():
                continue
            gone = {numbers.get(search.candidates[number].effect, -1) for number in group}
            for key in _in_place(search, first.key, again, numbers[effect], gone):
                if search.currency.error(again.validated[key].squares) <= most:
                    claims = open_to(effect, claims, group, search)
    return dataclasses.replace(first, claims=tuple(claims))


def beside_their_kind(answer: Answer, further: Sequence[Effect]) -> Answer:
    """The answer, with the form open of what is certain and of the kind, and at the place, of rarer
    effects that may be there beside it or in its place."""
    search = answer.found.search
    claims: Sequence[Claim] = answer.claims
    sure = {one.number: search.candidates[one.number].effect for one in claims if one.sure}
    for effect in further:
        kind = effect.family, effect.where
        alike = [number for number, one in sure.items() if (one.family, one.where) == kind]
        claims = open_to(effect, claims, alike, search)
    return dataclasses.replace(answer, claims=tuple(claims))


def _most(curve: Curve, claim: Claim, search: Search) -> float:
    """Forecast error with a curve in place of what is claimed, over that with it, up to which the
    curve is a rival; 0 if it is none."""
    effect = search.candidates[claim.number].effect
    if not isinstance(curve, ParameterCurve):
        return 0.0 if of_its_kind(curve, effect) else AS_GOOD
    # What moves alike as a constant does as well over anything then.
    if curve.parameter in (*claim.twins, *claim.form, *claim.alike):
        return 0.0
    return LESS**0.5 if curve.contains(effect) else CLEARLY


def _together(curve: Curve, search: Search, key: Key) -> tuple[int, ...]:
    """The named laws in whose place a curve is that has no more numbers than they have together.

    Where a speed settles by its input, friction is one of the input, too.
    """
    settling = {joint.name for joint in search.simulator.joints if joint.first_order}
    effects = {n: search.candidates[n].effect for n in key}
    laws = tuple(
        n
        for n, effect in effects.items()
        if is_law(effect, curve)
        or (curve.along == "input" and effect.family == "dissipation" and effect.where in settling)
    )
    enough = len(curve.strengths()) <= sum(len(search.candidates[n].knobs) for n in laws)
    return laws if len(laws) > 1 and enough and not isinstance(curve, ParameterCurve) else ()


def is_law(effect: Effect, curve: Curve) -> bool:
    """Whether an effect is a law that may be an imitation of a curve, and no parameter."""
    return effect.enters != "parameter" and of_its_kind(curve, effect)


def _leaves_less(first: Answer, second: Answer, curve: Curve, laws: Sequence[int]) -> bool:
    """Whether the best set with a curve in place of laws leaves clearly less than the best with
    them, whatever of other kinds is in either."""
    search, again = first.found.search, second.found.search
    numbers = _numbers(again)
    effects = [search.candidates[n].effect for n in laws]
    if not {curve, *effects} <= numbers.keys():
        return False
    points, named = numbers[curve], {numbers[effect] for effect in effects}
    _in_place(search, first.key, again, points, named)
    alike = {points, *(n for effect, n in numbers.items() if is_law(effect, curve))}
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


def _numbers(search: Search) -> dict[Effect, int]:
    """The place of every candidate, by its effect."""
    return {candidate.effect: n for n, candidate in enumerate(search.candidates)}


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


def open_to(
    other: Effect, claims: Sequence[Claim], numbers: Collection[int], search: Search
) -> list[Claim]:
    """Claims of which those of some candidates may stand for another effect: where it is of the
    family of one, and at its place, the form of that is open."""
    found = []
    for claim in claims:
        effect = search.candidates[claim.number].effect
        alike = (other.family, other.where) == (effect.family, effect.where) and other.family
        if claim.number in numbers and alike:
            claim = dataclasses.replace(claim, form=_with(claim.form, other))
        elif claim.number in numbers:
            claim = dataclasses.replace(claim, rivals=_with(claim.rivals, other))
        found.append(claim)
    return found


def _with(names: tuple[str, ...], *more: object) -> tuple[str, ...]:
    """Names and more of them, each once."""
    return tuple(dict.fromkeys((*names, *map(str, more))))
