"""The answer as plain data: verdicts, the table of errors, and what the log cannot show."""

from __future__ import annotations

from collections.abc import Sequence

from residual.gap.answer.calibrated import calibrated_verdict, moved
from residual.gap.answer.company import in_company
from residual.gap.answer.confirmed import Answer
from residual.gap.answer.evidence import evidence
from residual.gap.answer.table import gap, rollouts
from residual.gap.answer.verdicts import (
    blind_verdict,
    dependent,
    effect_verdict,
    minor_verdict,
    no_gap_verdict,
    parted_verdict,
    remainder_verdict,
)
from residual.gap.beside import Blind
from residual.gap.confirmation.aliases import hidden
from residual.gap.confirmation.certainty import TOO_FEW, share
from residual.gap.confirmation.claim import Claim
from residual.gap.fitting.forecasts import fitted_floor
from residual.gap.result import Gap, GapResult, Verdict
from residual.gap.search.comparisons import helps, material
from residual.gap.search.explain import FOOTNOTE
from residual.gap.search.pool import Key
from residual.gap.search.redundant import doubles
from residual.gap.search.sets import Search
from residual.logs.checks import Finding

#: Forecast error over that by noise alone up to which there may be no gap.
NEAR_NOISE = 1.5
#: Forecast error over that by noise alone beyond which something is missing although impacts hide
#: it from the fit: the integration step makes some of it.
PARTED = 2.0


def summed_up(answer: Answer) -> Gap:
    """The table of errors."""
    found, search = answer.found, answer.found.search
    if search.simulator.has_contacts:
        floor = fitted_floor(search.fitter, search.tried[answer.key], found.floor.sigma)
    else:
        floor = found.by_noise(answer.key)
    order = [claim.number for claim in answer.claims]
    return gap(search, answer.key, order, floor, (found.nominal_left.ratio, answer.left.ratio))


def told(
    answer: Answer, table: Gap, apart: Gap | None, sets: Sequence[tuple[str, ...]],
    tolerance: float | None, quality: Sequence[Finding], seconds: dict[str, float],
) -> GapResult:  # fmt: skip
    """Everything as plain data."""
    found, search, key = answer.found, answer.found.search, answer.key
    fitter, simulator = search.fitter, search.simulator
    corrected = answer.corrected
    finer = corrected.substeps > simulator.substeps
    if finer:
        says = (
            f"what was found is faster than the nominal simulator: the corrected one takes "
            f"{corrected.substeps} sub-steps in a control period, not {simulator.substeps}"
        )
        quality = [*quality, Finding("search", "", says)]
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
    search = answer.found.search
    labels = [search.candidates[claim.number].label for claim in answer.claims]
    blocks = len(search.fitter.blocks)
    left = answer.left
    times = 1.0 if left.adequate else left.ratio

    def of_effects(claims: Sequence[Claim]) -> list[Verdict]:
        return [
            effect_verdict(search, claim, blocks, *dependent(label, labels, sets), times)
            for claim, label in zip(claims, labels, strict=True)
        ]

    made = of_effects(answer.claims)
    if not left.adequate:
        made = of_effects(in_company(search, answer.key, answer.claims, made))
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
    elif not made and (blocks < TOO_FEW or table.drowned):  # too little to say there is no gap
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
