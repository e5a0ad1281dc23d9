"""From a choice to what stays of it: claims of its effects, and what cannot be named left out."""

from __future__ import annotations

import dataclasses
import functools
import time

import numpy as np

from residual.gap.answer.verdicts import nameable
from residual.gap.confirmation.certainty import claims
from residual.gap.confirmation.claim import Claim
from residual.gap.confirmation.numerics import by_profile, other_numerics, with_enough_substeps
from residual.gap.confirmation.rivals import in_plain_form
from residual.gap.confirmation.size import FAR, may_vanish
from residual.gap.confirmation.tolerance import allow_for_parameters
from residual.gap.fitting.contract import Left
from residual.gap.fitting.forecasts import main_channel, noise_floor
from residual.gap.fitting.plausible import ratios, stands_still
from residual.gap.search.choice import better_fit
from residual.gap.search.comparisons import material
from residual.gap.search.exchange import add_exchanged, add_without_each
from residual.gap.search.explain import LEAST, NOTABLE, Explanation
from residual.gap.search.imitation import imitated
from residual.gap.search.known import KNOWN
from residual.gap.search.pool import Key
from residual.gap.search.sets import Search
from sims.host import HostSimulator

#: Effects tried in place of each that is left when one cannot be named: of few, and of more.
RIVALS, FEW = 3, 3
#: Part by which another set errs less that is asked in place of what is left of one.
LIKELIER = 0.1
#: Residual over noise from which on something clearly has no name, and times a parameter may be its
#: nominal value, either way, to be believed beside that.
UNNAMED, SEVERAL = 3.0, 4.0
#: Rise of the loss with inputs held the other way, as a share of it, that rules that out.
OTHER_HOLD = 0.5


@dataclasses.dataclass(frozen=True)
class Answer:
    """What stays after confirmation.

    Attributes:
        found: Search and choice.
        key: What goes into the corrected simulator: chosen effects that can be named.
        claims: What bears on each of them.
        leads: Chosen effects that could not be named.
    """

    found: Explanation
    key: Key
    claims: tuple[Claim, ...]
    leads: tuple[str, ...]

    @property
    def left(self) -> Left:
        """What it leaves, beside the noise."""
        search = self.found.search
        return search.fitter.left(search.tried[self.key], self.found.floor)

    @functools.cached_property
    def corrected(self) -> HostSimulator:
        """The simulator with what was found."""
        search, fit = self.found.search, self.found.search.tried[self.key]
        return with_enough_substeps(fit.model.bind(fit.theta), search, self.key)


def matters(found: Explanation, tolerance: float | None) -> bool:
    """Whether the nominal simulator errs by more than a tolerance."""
    if tolerance is None:
        return True
    search = found.search
    floor = noise_floor(search.fitter, search.nominal, found.floor.sigma)
    squares = search.before.squares
    main = main_channel(search.simulator, search.fitter.samples.measured, squares, floor)
    return bool(np.sqrt(np.nanmean(squares[:, main])) > tolerance)


def confirm(
    found: Explanation,
    groups: dict[str, tuple[str, ...]],
    asked: bool = True,
    parameter_tolerance: float = KNOWN,
    until: float = np.inf,
) -> Answer:
    """Claims of the chosen effects; what cannot be named is left out, and the rest asked again.

    Args:
        found: The choice.
        groups: Exact twins by label.
        asked: False if the gap does not matter, so that nothing is named.
        parameter_tolerance: How well the simulator's parameters are known, as a share of each.
        until: When to ask no further, on the clock of ``time.process_time``.
    """
    search, key = found.search, found.key if asked else ()
    leads: tuple[str, ...] = ()
    asked_before = {key}
    search.weigh_until = until  # for what is left without what cannot be named

    def exchange(key: Key) -> None:
        most = RIVALS if len(key) <= FEW else LEAST
        add_exchanged(search, key, 0 if time.process_time() > until else most)

    while True:
        by_profile(search, key)
        fit = search.tried[key]
        slack = search.fitter.tie(search.tried[()]) if found.adequate else OTHER_HOLD * fit.merit
        numerics = other_numerics(search, key, slack) if key else []
        close = found.adequate or search.fitter.left(fit, found.floor).ratio < NOTABLE
        made = claims(search, key, found.adequate, close, groups, numerics)
        if found.adequate and len(key) == 2:
            alone = imitated(search, key)
            made = [dataclasses.replace(c, rivals=(*c.rivals, *alone)) for c in made]
        blocks = len(search.fitter.blocks)
        lost = [c for c in made if not nameable(search, c, blocks, found.adequate)]
        if not lost and key in search.refused:  # without those that went, it cannot be right
            lost = made
        if not lost and found.adequate and key and material(search, key, ()):
            lost = made  # what fits the noise of one part may forecast nothing of another
        if not lost and key and not found.adequate and stands_still(fit, search.fitter):
            lost = made  # it only switches off what the simulator has wrong
        if not lost:
            made = allow_for_parameters(
                search, key, made, found.adequate, parameter_tolerance, until, _much(found, key)
            )
            # Now that intervals allow for the parameters, too.
            doubtful = [c for c in made if not (c.needed or c.by_fit)]
            lost = [c for c in doubtful if may_vanish(search, c)]
            plainer = None if lost or found.adequate else in_plain_form(search, key, made)
            if plainer:
                key = plainer
                exchange(key)
                continue
        if not lost:
            leads = tuple(label for label in leads if label not in search.labels(key))
            return with_stand_ins(_in_time(Answer(found, key, tuple(made), leads)))
        # The one that matters least goes first: what is left may have fewer rivals.
        gone = lost[-1].number
        leads = tuple(dict.fromkeys((search.candidates[gone].label, *leads)))
        key, theta = search.merged(key, (), drop=(gone,))
        search.add({key: theta})
        exchange(key)
        if not found.adequate:
            key = likelier(search, key, asked_before)
            add_without_each(search, key)
        asked_before.add(key)


def _much(found: Explanation, key: Key) -> bool:
    """Whether what a set leaves is many times the noise."""
    return much(Answer(found, key, (), ()))


def _in_time(answer: Answer) -> Answer:
    """An answer of which nothing is certain where much is left, and there was no time to ask what
    may stand in place of one of its effects: the others may make up for that one."""
    return untimely(answer) if any(claim.unasked for claim in answer.claims) else answer


def untimely(answer: Answer) -> Answer:
    """An answer for which there was no time to ask something: nothing is certain of it where much
    is left."""
    claims = (dataclasses.replace(claim, unasked=True) for claim in answer.claims)
    return dataclasses.replace(answer, claims=tuple(claims)) if much(answer) else answer


def much(answer: Answer) -> bool:
    """Whether what an answer leaves is many times the noise."""
    return not answer.found.adequate and answer.left.ratio >= FAR


def with_stand_ins(answer: Answer) -> Answer:
    """An answer in which parameters several times their nominal values, or a fraction of them, are
    not certain beside a remainder: so far off they may stand for a law of another form."""
    if answer.found.adequate or answer.left.ratio < UNNAMED:
        return answer
    fit = answer.found.search.tried[answer.key]
    found = ratios(fit.model.bind(fit.theta), fit.model.added(fit.theta))
    off = {answer.key[n] for n, ratio in found.items() if not 1 / SEVERAL <= ratio <= SEVERAL}
    return dataclasses.replace(
        answer,
        claims=tuple(
            dataclasses.replace(claim, stretched=claim.number in off) for claim in answer.claims
        ),
    )


def likelier(search: Search, key: Key, asked: set[Key]) -> Key:
    """What is left of a set, or another as small that forecasts clearly better.

    What is left of the best set of three need not be the best set of two.

    Args:
        search: With what is left, ``key``.
        asked: Sets that lost a member already.
    """
    fewer = [k for k in search.usable() if len(k) <= len(key) and k not in asked]
    small = [k for k in fewer if search.numbers(k) <= search.numbers(key)]
    if not small:
        return key
    best = better_fit(search, small)
    return best if (1 + LIKELIER) * search.error(best) < search.error(key) else key
