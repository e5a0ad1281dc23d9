"""From a choice to the answer: confirmation, the table of errors, and everything as plain data."""

from __future__ import annotations

import dataclasses
import functools
import time
from collections.abc import Sequence

import numpy as np

from residual.gap.answer.calibrated import calibrated_verdict, moved
from residual.gap.answer.evidence import evidence
from residual.gap.answer.table import gap, rollouts
from residual.gap.answer.verdicts import (
    blind_verdict,
    dependent,
    effect_verdict,
    minor_verdict,
    nameable,
    no_gap_verdict,
    parted_verdict,
    remainder_verdict,
)
from residual.gap.beside import Blind
from residual.gap.confirmation.aliases import hidden
from residual.gap.confirmation.certainty import TOO_FEW, claims, in_plain_form, share
from residual.gap.confirmation.claim import Claim
from residual.gap.confirmation.numerics import other_numerics, with_enough_substeps
from residual.gap.confirmation.size import may_vanish
from residual.gap.confirmation.tolerance import allow_for_parameters
from residual.gap.fitting.forecasts import fitted_floor, main_channel, noise_floor
from residual.gap.result import Gap, GapResult, Verdict
from residual.gap.search.choice import better_fit
from residual.gap.search.comparisons import helps, material
from residual.gap.search.exchange import add_exchanged
from residual.gap.search.explain import FOOTNOTE, Explanation
from residual.gap.search.imitation import imitated
from residual.gap.search.known import KNOWN
from residual.gap.search.redundant import doubles
from residual.gap.search.sets import Key, Search
from sims.host import HostSimulator

#: Effects tried in place of each that is left when one cannot be named.
RIVALS = 3
#: Forecast error over that by noise alone up to which there may be no gap.
NEAR_NOISE = 1.5
#: Forecast error over that by noise alone beyond which something is missing although impacts hide
#: it from the fit: the integration step makes some of it.
PARTED = 2.0
#: Part by which another set errs less that is asked in place of what is left of one.
LIKELIER = 0.1
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

    def exchange(key: Key) -> None:
        add_exchanged(search, key, 0 if time.process_time() > until else RIVALS)

    while True:
        fit = search.tried[key]
        slack = search.fitter.tie(search.tried[()]) if found.adequate else OTHER_HOLD * fit.merit
        numerics = other_numerics(search, key, slack) if key else []
        made = claims(search, key, found.adequate, groups, numerics)
        if found.adequate and len(key) == 2:
            alone = imitated(search, key)
            made = [dataclasses.replace(c, rivals=(*c.rivals, *alone)) for c in made]
        blocks = len(search.fitter.blocks)
        lost = [c for c in made if not nameable(search, c, blocks, found.adequate)]
        if not lost and key in search.refused:  # without those that went, it cannot be right
            lost = made
        if not lost and found.adequate and key and material(search, key, ()):
            lost = made  # what fits the noise of one part may forecast nothing of another
        if not lost:
            made = allow_for_parameters(
                search, key, made, found.adequate, parameter_tolerance, until
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
            return Answer(found, key, tuple(made), leads)
        # The one that matters least goes first: what is left may have fewer rivals.
        gone = lost[-1].number
        leads = (search.candidates[gone].label, *leads)
        key, theta = search.merged(key, (), drop=(gone,))
        search.add({key: theta})
        exchange(key)
        if not found.adequate:
            key = likelier(search, key, asked_before)
        asked_before.add(key)


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


def summed_up(answer: Answer) -> Gap:
    """The table of errors."""
    found, search = answer.found, answer.found.search
    by_noise = fitted_floor if search.simulator.has_contacts else noise_floor
    floor = by_noise(search.fitter, search.tried[answer.key], found.floor.sigma)
    left = search.fitter.left(search.tried[answer.key], found.floor)
    order = [claim.number for claim in answer.claims]
    return gap(search, answer.key, order, floor, (found.nominal_left.ratio, left.ratio))


def told(
    answer: Answer, table: Gap, apart: Gap | None, sets: Sequence[tuple[str, ...]],
    tolerance: float | None, quality: Sequence[str], seconds: dict[str, float],
) -> GapResult:  # fmt: skip
    """Everything as plain data."""
    found, search, key = answer.found, answer.found.search, answer.key
    fitter, simulator = search.fitter, search.simulator
    corrected = answer.corrected
    finer = corrected.substeps > simulator.substeps
    if finer:
        quality = [
            *quality,
            f"what was found is faster than the nominal simulator: the corrected one takes "
            f"{corrected.substeps} sub-steps in a control period, not {simulator.substeps}",
        ]
    measured = [simulator.physical_channels[c] for c in fitter.samples.measured]
    blind: tuple[Blind, ...] = ()
    if found.adequate and len(fitter.blocks) >= TOO_FEW:
        known = {name for claim in answer.claims for name in claim.stand_ins}
        alone = [k for k in search.validated if len(k) == 1]
        known |= {search.labels(k)[0] for k in alone if helps_alone(search, k)}
        known |= {
            one.label for n, one in enumerate(search.candidates) if doubles(search, (*key, n))
        }
        unseen = hidden(search.signatures(key), search.candidates, key, found.needed)
        blind = tuple(one for one in unseen if one.effect not in known)
    where = fitter.where(search.nominal, found.floor)
    return GapResult(
        verdicts=tuple(verdicts(answer, table, sets, tolerance, blind)),
        gap=table,
        held_out=apart,
        where=where,
        evidence=evidence(found, key, answer.leads),
        rollouts=rollouts(search, search.before, search.validated[key]),
        effects=tuple(corrected.effects[len(simulator.effects) :]),
        corrected=corrected,
        substeps=corrected.substeps if finer else None,
        channels=tuple((channel.name, channel.unit) for channel in measured),
        noise={
            channel.name: (float(s), float(e))
            for channel, s, e in zip(measured, found.floor.sigma, found.floor.error, strict=True)
        },
        quality=tuple(quality),
        blind=blind,
        adequate=found.adequate,
        seconds=seconds,
    )


def helps_alone(search: Search, key: Key) -> bool:
    """Whether an effect alone takes a material part of the error off: the log does show it."""
    return search.sound(key) and material(search, (), key)


def verdicts(
    answer: Answer, table: Gap, sets: Sequence[tuple[str, ...]], tolerance: float | None,
    blind: Sequence[Blind],
) -> list[Verdict]:  # fmt: skip
    """All verdicts, most important first: what is certain, then what takes off most."""
    found, search = answer.found, answer.found.search
    labels = [search.candidates[claim.number].label for claim in answer.claims]
    blocks = len(search.fitter.blocks)
    made: list[Verdict] = []
    left = search.fitter.left(search.tried[answer.key], found.floor)
    times = 1.0 if left.adequate else left.ratio
    for claim, label in zip(answer.claims, labels, strict=True):
        exact = dependent(label, labels, sets)
        made.append(effect_verdict(search, claim, blocks, *exact, times))
    made.sort(key=lambda verdict: verdict.kind != "confirmed")
    if shifted := moved(search, answer.key):
        made.append(calibrated_verdict(search, shifted))
    if tolerance is not None and table.before.value <= tolerance:
        made.insert(
            0,
            no_gap_verdict(
                f"nothing that matters: the {table.horizon_s:.3g} s error is "
                f"{table.before.value:.3g} {table.unit}, within the tolerance of {tolerance:.3g}"
            ),
        )
    elif search.simulator.has_contacts and table.exceeds_noise(PARTED, corrected=True):
        made.append(parted_verdict(table, answer.leads))
    elif not made and blocks < TOO_FEW:  # too few to say that there is no gap
        made.append(remainder_verdict(left, table, answer.leads))
    elif not answer.key and left.adequate and not search.beside:
        made.append(no_gap_verdict("no gap above noise"))
    elif not answer.key and not search.beside and within_noise(table):
        made.append(
            no_gap_verdict(
                f"forecasts err no more than by noise; residuals are {left.ratio:.3g} times that"
            )
        )
    elif not left.adequate and (left.ratio > FOOTNOTE or not made):
        made.append(remainder_verdict(left, table, answer.leads))
    for number, taken in minor(answer).items():
        made.append(minor_verdict(search, number, taken))
    if blind:
        made.append(blind_verdict(blind))
    return made


def within_noise(table: Gap) -> bool:
    """Whether forecasts of the nominal simulator err by no more than noise may."""
    near = table.before.value <= NEAR_NOISE * table.noise_floor.value
    return near and table.before.low <= table.noise_floor.high


def minor(answer: Answer) -> dict[int, tuple[float, float, float]]:
    """Candidates that help the chosen set by too little, and the share that they would add.

    What helped only in another set's company is none: it is part of another explanation; nor is
    what would do the work of one that could not be named.
    """
    search, key = answer.found.search, answer.key
    shares = {}
    for number in answer.found.choice.minor:
        larger = tuple(sorted({*key, number}))
        tried = larger != key and larger in search.validated and search.sound(larger)
        if tried and helps(search, key, larger) and not material(search, key, larger):
            shares[number] = share(search, larger, number)
    return shares
