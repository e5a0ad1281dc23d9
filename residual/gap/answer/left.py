"""What is left of a gap when effects are named, and whether further effects explain most of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from residual.gap.answer.confirmed import Answer
from residual.gap.answer.free_parameters import better
from residual.gap.confirmation.drift import beside
from residual.gap.fitting.contract import Fit
from residual.gap.fitting.screening import beside_starts
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.model.candidates import Candidate, candidates
from residual.gap.model.model import Model
from residual.gap.search.at_sight import of_one_pair
from residual.gap.search.explain import FOOTNOTE, NOTABLE
from residual.gap.search.pool import Key
from residual.gap.search.pushes import constant, of_one_kind
from sims.effects.base import Effect
from sims.effects.flexible import FlexiblePart

#: Part of the squared forecast error of the library's laws, less what noise makes, that further
#: effects may leave; where they stand for more effects than they are.
QUARTER, OF_MORE = 0.25, 0.5
#: Part of what is left beyond noise that its cause may leave in the linear picture.
HALF = 0.5
#: Loss over that of one of its family, up to which an effect fits about as well; squared forecast
#: error over that of more effects, up to which what fits down to the noise forecasts so.
NEARLY = 1.25
#: Effects that are fitted from the nominal simulator on, and effects in whose place one may stand.
NEAREST, IN_PLACE = 3, (2, 4)
#: Effects fewer with which an answer that forecasts as well is the simpler one, whatever numbers
#: these have.
FEWER = 2
#: Effects from which on they are several.
SEVERAL = 3
#: Part of the gap without a name that is much, however little it is beside noise.
MUCH = 0.3


def worth_a_part(answer: Answer, parts: Sequence[FlexiblePart]) -> Sequence[FlexiblePart]:
    """The flexible parts to ask for: all, if clearly more than noise is left, or of the gap."""
    search = answer.found.search
    if not isinstance(search.fitter, SmoothFitter) or answer.left.adequate:
        return ()
    if much_is_left(answer):
        return parts
    nominal = search.currency.error(search.validated[()].squares) ** 2
    left, least = beside_noise(answer, answer.key)
    return parts if left - least > MUCH * (nominal - least) else ()


def worth_asking_for(answer: Answer, further: Sequence[Effect]) -> list[Effect]:
    """The rarer effects to ask for, where clearly more than noise is left: those that take half of
    it in the linear picture, or that fit about as well in place of what is of their family, and at
    their place, or of all but one that was named, so that a search is not made in vain."""
    search, key = answer.found.search, answer.key
    fitter, fit = search.fitter, search.tried[key]
    if not isinstance(fitter, SmoothFitter) or not much_is_left(answer):
        return []
    most = half_beyond_noise(answer, fit.merit)
    offered = {candidate.label for candidate in search.candidates}
    rest = [effect for effect in further if str(effect) not in offered]
    pool = candidates(fit.model.simulator, rest, fitter.samples)
    moved = [beside_starts(fit, fitter.columns(fit, [one])) for one in pool]

    def takes_most(*numbers: int) -> bool:
        return beside(fit, [moved[n] for n in numbers], fitter.cap).loss < most

    worth = {n for n in range(len(pool)) if takes_most(n)}
    for two in of_one_pair(pool):
        worth |= set(two) if takes_most(*two) else set()
    for alike in of_one_kind(pool):
        if _fit_in_place_of_pushes([pool[n] for n in alike], fitter, fit):
            worth |= set(alike)
    worth |= fit_in_place_of_most(pool, answer)
    return [
        one.effect for n, one in enumerate(pool) if n in worth or _fits_in_place(one, fitter, fit)
    ]


def _fits_in_place(one: Candidate, fitter: SmoothFitter, fit: Fit) -> bool:
    """Whether an effect fits about as well in place of what is of its family, and at its place, or
    of a constant push that it is in the mean."""
    chosen = fit.model.chosen
    for gone in _in_whose_place(one.effect, [candidate.effect for candidate in chosen]):
        kept = [candidate for i, candidate in enumerate(chosen) if i not in gone]
        own = fit.theta[~np.isin(fit.model.owner, gone)]
        model = Model(fit.model.simulator, [*kept, one])
        starts = (np.append(own, trial.values[0]) for trial in one.trials)
        if any(fitter.fit(model, start, fit).merit < NEARLY * fit.merit for start in starts):
            return True
    return False


def _fit_in_place_of_pushes(several: Sequence[Candidate], fitter: SmoothFitter, fit: Fit) -> bool:
    """Whether some effects together fit about as well in place of several constant pushes."""
    chosen, gone = fit.model.chosen, constant(fit.model.chosen)
    if len(gone) < 2:
        return False
    kept = [i for i in range(len(chosen)) if i not in gone]
    model = Model(fit.model.simulator, [*(chosen[i] for i in kept), *several])
    own = fit.theta[np.isin(fit.model.owner, kept)]
    start = np.concatenate([own, *(one.trials[0].values[0] for one in several)])
    return fitter.fit(model, start, fit).merit < NEARLY * fit.merit


def fit_in_place_of_most(pool: Sequence[Candidate], answer: Answer) -> set[int]:
    """Numbers of those that, alone or beside one effect that was named, fit about as well as all of
    these, with no more numbers: the slope of a bent law and a constant come near to it.

    They are told from the nominal simulator on, in the linear picture there, and fitted in full,
    since they are to make most of the gap.

    Args:
        pool: What may stand in their place.
        answer: Of a system without impacts.
    """
    search, key = answer.found.search, answer.key
    fitter, fit, nominal = search.fitter, search.tried[key], search.nominal
    if not IN_PLACE[0] <= len(key) <= IN_PLACE[1]:
        return set()
    assert isinstance(fitter, SmoothFitter)
    moved = [beside_starts(nominal, fitter.columns(nominal, [one])) for one in pool]
    loss = np.array([beside(nominal, [columns], fitter.cap).loss for columns in moved])

    def fits(one: Candidate, kept: Key) -> bool:
        model = Model(search.simulator, [*(search.candidates[n] for n in kept), one])
        own = fit.theta[np.isin(fit.model.owner, [key.index(n) for n in kept])]
        starts = (np.append(own, trial.values[0]) for trial in one.trials)
        return len(model) <= len(fit.theta) and any(
            fitter.fit(model, start, nominal).merit < NEARLY * fit.merit for start in starts
        )

    nearest = np.argsort(loss)[:NEAREST].tolist()
    beside_one: list[Key] = [(), *((n,) for n in key)]
    return {n for n in nearest if any(fits(pool[n], kept) for kept in beside_one)}


def _in_whose_place(further: Effect, chosen: Sequence[Effect]) -> list[list[int]]:
    """Members, by place, that a further effect may stand for: all of its family where it acts; or
    each of the constant pushes, if it pushes in the mean."""
    kind = further.family, further.where
    alike = [i for i, one in enumerate(chosen) if kind == (one.family, one.where)]
    pushes = [[i] for i, one in enumerate(chosen) if further.pushes and one.creeps]
    return [alike, *pushes] if alike and further.family else pushes


def half_beyond_noise(answer: Answer, loss: float) -> float:
    """Half of a loss, beside what noise alone makes: what a remainder with a cause leaves at most.

    Args:
        answer: Of a system without impacts.
        loss: What is left without that cause.
    """
    fitter = answer.found.search.fitter
    assert isinstance(fitter, SmoothFitter)
    by_noise = fitter.noise_alone(answer.found.floor.sigma)
    return by_noise + HALF * (loss - by_noise)


def much_is_left(answer: Answer) -> bool:
    """Whether what was named leaves clearly more than noise; more than noise where it is several
    effects, which together come near to any law, or has a size that can hardly be."""
    left, key = answer.left, answer.key
    least = FOOTNOTE if len(key) >= SEVERAL or key in answer.found.search.extreme else NOTABLE
    return not left.adequate and left.ratio > least


def beside_noise(answer: Answer, key: Key) -> tuple[float, float]:
    """Squared forecast error of a set, and what noise alone makes."""
    search = answer.found.search
    by_noise = answer.found.by_noise(key)
    squares = search.validated[key].squares, by_noise
    left, least = (search.currency.error(one) ** 2 for one in squares)
    return left, least


def takes_what_is_left(second: Answer, first: Answer, more: Sequence[Effect]) -> bool:
    """Whether further effects were named and take most of what the library left beside noise, half
    of it where they stand for more than they are, or stand for three and forecast no worse, or
    about as well where they leave no more than noise.

    Args:
        second: What was found with them on offer, too; ``first``: without.
        more: The further effects.
    """
    search, again = first.found.search, second.found.search
    if not {str(effect) for effect in more}.intersection(again.labels(second.key)):
        return False
    left, least = beside_noise(first, first.key)
    now = search.currency.error(again.validated[second.key].squares) ** 2
    fewer = len(first.key) - len(second.key)
    if fewer >= FEWER and now <= (NEARLY if second.left.adequate else 1.0) * left:
        return True
    most = OF_MORE if fewer > 0 else QUARTER
    return now - least < most * (left - least) and better(second, first)


def takes_most_by_itself(answer: Answer, more: Sequence[Effect]) -> bool:
    """Whether further effects were named that take most of what all else named would leave."""
    search, key = answer.found.search, answer.key
    own = named_of(answer, more)
    if not own:
        return False
    rest, start = search.merged(key, (), drop=own)
    if rest not in search.tried:
        search.fit(rest, start)
    left, least = beside_noise(answer, rest)
    # What swings from a state of its own is foretold from noise as well.
    now, by_noise = beside_noise(answer, key)
    return now - max(least, by_noise) < QUARTER * (left - least)


def named_of(answer: Answer, effects: Sequence[Effect]) -> Key:
    """Which of some effects were named."""
    labels, search = {str(effect) for effect in effects}, answer.found.search
    return tuple(number for number in answer.key if search.candidates[number].label in labels)


def names_more(answer: Answer, earlier: Answer) -> bool:
    """Whether an answer names what an earlier one does, or of its family, is sure of all that that
    one was, and names more."""
    return (
        len(answer.key) > len(earlier.key)
        and _among(answer, answer.key, earlier, earlier.key)
        and _among(answer, _sure(answer), earlier, _sure(earlier))
    )


def still_names(answer: Answer, earlier: Answer) -> bool:
    """Whether an answer names all that an earlier one does with certainty, or of its family."""
    return _among(answer, answer.key, earlier, _sure(earlier))


def _sure(answer: Answer) -> list[int]:
    return [claim.number for claim in answer.claims if claim.sure]


def _among(answer: Answer, there: Sequence[int], earlier: Answer, wanted: Sequence[int]) -> bool:
    """Whether effects of an earlier answer, or of their families, are among those of another."""
    own = [answer.found.search.candidates[number].effect for number in there]
    known = [earlier.found.search.candidates[number].effect for number in wanted]
    return all(
        any(str(one) == str(e) or (e.family and (one.family, one.where) == (e.family, e.where))
            for one in own)
        for e in known
    )  # fmt: skip
