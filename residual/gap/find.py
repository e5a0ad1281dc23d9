"""The pipeline: data, numerics, search, choice, confirmation, verdict."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.aliases import aliases, hidden
from residual.gap.candidates import candidates
from residual.gap.confirmation import Claim, claims, share
from residual.gap.data import examine
from residual.gap.explain import Explanation, explain
from residual.gap.forecasts import gap, held_out, noise_floor, rollouts
from residual.gap.horizon import usual_horizon
from residual.gap.model import Model
from residual.gap.numerics import better_hold, other_numerics
from residual.gap.prepare import Prepared, prepare
from residual.gap.result import Blind, Gap, GapResult, Rival, Verdict
from residual.gap.search import Key
from residual.gap.verdicts import (
    FOOTNOTE,
    blind_verdict,
    dependent,
    effect_verdict,
    minor_verdict,
    nameable,
    no_gap_verdict,
    remainder_verdict,
)
from residual.gap.workers import workers
from residual.trajectories import Trajectory
from sims.effects.base import Effect
from sims.effects.library import library
from sims.host import HostSimulator
from sims.simulator import Hold

Array = NDArray[np.float64]

#: Sets listed as evidence.
EVIDENCE = 40
#: Rise of the loss with inputs held the other way, as a share of it, that rules that out.
OTHER_HOLD = 0.5
#: Part of the time budget after which nothing new is tried.
SEARCHING = 0.7


def find_gap(
    simulator: HostSimulator,
    trajectories: Sequence[Trajectory],
    *,
    held: Sequence[Trajectory] = (),
    tolerance: float | None = None,
    effects: Iterable[Effect] | None = None,
    hold: Hold | Mapping[str, Hold] | None = None,
    measured_input: bool = False,
    horizon: float | None = None,
    minutes: float = 2.0,
    n_jobs: int = 1,
    progress: Callable[[str], None] | None = None,
) -> GapResult:
    """Find where a simulator and measured logs disagree, and name what is missing.

    Args:
        simulator: The nominal simulator.
        trajectories: Measured runs; blocks of them are left out in turn to judge what is found.
        held: Runs that are used for the final table only.
        tolerance: Forecast error that does not matter, in the unit of the first measured
            position; below it the verdict is "nothing that matters".
        effects: Effects that may be missing; by default all that the simulator can host.
        hold: How inputs run between samples, ``"zero"`` (held, as commands are) or ``"linear"``
            (straight to the next, as most measured inputs are), for all or by input; by default
            whichever the nominal simulator fits better.
        measured_input: True if the logged inputs were measured at the actuator's output; what
            happens before that (dead zone, saturation, lag) is then no candidate.
        horizon: Forecast length in seconds; by default a third of the usual period of the motion,
            see ``residual.gap.horizon``.
        minutes: Time budget; the search for rival explanations ends in time.
        n_jobs: Processes for a simulator that steps row by row.
        progress: Called with a line of text now and then.

    Returns:
        The verdicts and everything behind them.

    Raises:
        ValueError: There are no trajectories, nothing was measured, samples are too rare, the
            simulator returns values that are not finite, or a position of a system that strikes
            the ground was not measured.
    """
    clock = Clock()
    tell = progress or (lambda _: None)
    until = time.perf_counter() + 60 * minutes * SEARCHING
    offered = tuple(library(simulator) if effects is None else effects)
    if measured_input:
        offered = tuple(e for e in offered if not e.upstream_of_sensor)
    examined = examine(simulator, trajectories)
    runs = examined.trajectories
    quality = [f"{finding.where} {finding.says}".strip() for finding in examined.findings]
    for says in quality:
        tell(says)
    horizon = horizon or usual_horizon(simulator, runs)
    with workers(n_jobs):
        simulator, held_how = better_hold(simulator, runs, horizon, hold)
        quality += held_how
        prepared = prepare(simulator, runs, horizon)
        groups, sets = aliases(simulator, offered)
        kept = [e for e in offered if groups.get(str(e), (str(e),))[0] == str(e)]
        pool = prepared.pool(candidates(simulator, kept, prepared.fitter.samples))
        clock.lap("read")
        tell(
            f"{len(prepared.fitter.blocks)} blocks of data, forecasts over {horizon:.3g} s, "
            f"{len(pool)} candidate effects"
        )
        found = explain(
            simulator, pool, prepared.fitter, prepared.floor, prepared.weigh,
            prepared.effort, tell, until,
        )  # fmt: skip
        clock.lap("search")
        tell("confirming")
        answer = confirm(found, prepared, groups)
        clock.lap("confirm")
        table = summed_up(answer)
        apart = None
        if held:
            apart = judged_apart(answer, prepared, examine(simulator, held).trajectories, table)
        clock.lap("forecast")
    return told(answer, table, apart, sets, tolerance, quality, clock.laps)


class Clock:
    """Seconds by stage."""

    def __init__(self) -> None:
        self.laps: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, stage: str) -> None:
        """End of a stage."""
        now = time.perf_counter()
        self.laps[stage] = now - self._last
        self._last = now


@dataclasses.dataclass(frozen=True)
class Answer:
    """What stays after confirmation.

    Attributes:
        found: Search and choice.
        key: What goes into the corrected simulator: chosen effects that can be named.
        claims: What bears on each of them.
        leads: Chosen effects that could be too many others.
    """

    found: Explanation
    key: Key
    claims: tuple[Claim, ...]
    leads: tuple[str, ...]


def confirm(found: Explanation, prepared: Prepared, groups: dict[str, tuple[str, ...]]) -> Answer:
    """Claims of the chosen effects; what cannot be named is left out, and the rest asked again."""
    search, key = found.search, found.key
    leads: tuple[str, ...] = ()
    while True:
        fit = search.tried[key]
        slack = search.fitter.tie(search.tried[()]) if found.adequate else OTHER_HOLD * fit.merit
        numerics = other_numerics(search, key, slack) if key else []
        made = claims(search, key, found.adequate, groups, numerics)
        blocks = len(search.fitter.blocks)
        lost = [claim for claim in made if not nameable(search, claim, blocks)]
        if not lost:
            return Answer(found, key, tuple(made), leads)
        # The one that matters least goes first: what is left may have fewer rivals.
        gone = lost[-1].number
        leads = (search.candidates[gone].label, *leads)
        key = tuple(i for i in key if i != gone)
        search.add({key: search.merged((*key, gone), (), drop=(gone,))[1]} if key else {})
        search.add_exchanged(key, 3)


def summed_up(answer: Answer) -> Gap:
    """The table of errors."""
    found, search = answer.found, answer.found.search
    floor = noise_floor(search.fitter, search.tried[answer.key], found.floor.sigma)
    left = search.fitter.left(search.tried[answer.key], found.floor)
    order = [claim.number for claim in answer.claims]
    return gap(search, answer.key, order, floor, (found.nominal_left.ratio, left.ratio))


def judged_apart(answer: Answer, prepared: Prepared, runs: Sequence[Trajectory], table: Gap) -> Gap:
    """The same table for records that were set aside."""
    search = answer.found.search
    other = prepare(search.simulator, runs, prepared.horizon).fitter
    other = other.weighed_like(search.fitter)
    fits = []
    for key in ((), answer.key):
        model = Model(search.model(key).bind(search.tried[key].theta))
        fits.append(other.fit(model, np.zeros(0)))
    floor = noise_floor(other, fits[1], answer.found.floor.sigma)
    return held_out(table, other, fits[0], fits[1], floor)


def told(
    answer: Answer, table: Gap, apart: Gap | None, sets: Sequence[tuple[str, ...]],
    tolerance: float | None, quality: Sequence[str], seconds: dict[str, float],
) -> GapResult:  # fmt: skip
    """Everything as plain data."""
    found, search, key = answer.found, answer.found.search, answer.key
    fitter, simulator = search.fitter, search.simulator
    fit = search.tried[key]
    corrected = fit.model.bind(fit.theta)
    measured = [simulator.physical_channels[c] for c in fitter.samples.measured]
    blind: tuple[Blind, ...] = ()
    if found.adequate:
        blind = hidden(search.signatures(key), search.candidates, key, found.needed)
    where = fitter.where(search.tried[()], found.floor)
    return GapResult(
        verdicts=tuple(verdicts(answer, table, sets, tolerance, blind)),
        gap=table,
        held_out=apart,
        where=where,
        evidence=evidence(answer),
        rollouts=rollouts(search, search.validated[()], search.validated[key]),
        effects=tuple(corrected.effects[len(simulator.effects) :]),
        corrected=corrected,
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


def verdicts(
    answer: Answer, table: Gap, sets: Sequence[tuple[str, ...]], tolerance: float | None,
    blind: Sequence[Blind],
) -> list[Verdict]:  # fmt: skip
    """All verdicts, most important first."""
    found, search = answer.found, answer.found.search
    labels = [search.candidates[claim.number].label for claim in answer.claims]
    blocks = len(search.fitter.blocks)
    made: list[Verdict] = []
    for claim, label in zip(answer.claims, labels, strict=True):
        made.append(effect_verdict(search, claim, blocks, *dependent(label, labels, sets)))
    left = search.fitter.left(search.tried[answer.key], found.floor)
    if tolerance is not None and table.before.value <= tolerance:
        made.insert(
            0,
            no_gap_verdict(
                f"nothing that matters: the {table.horizon_s:.3g} s error is "
                f"{table.before.value:.3g} {table.unit}, within the tolerance of {tolerance:.3g}"
            ),
        )
    elif not answer.key and left.adequate:
        made.append(no_gap_verdict("no gap above noise"))
    elif not left.adequate and left.ratio > FOOTNOTE:
        made.append(remainder_verdict(left, table, answer.leads))
    for number, with_it in found.choice.minor.items():
        if number not in answer.key:
            made.append(minor_verdict(search, number, share(search, with_it, number)))
    if blind:
        made.append(blind_verdict(blind))
    return made


def evidence(answer: Answer) -> tuple[Rival, ...]:
    """What was tried, the chosen set first, then by error."""
    search, found = answer.found.search, answer.found
    reasons = found.choice.reasons
    if found.key != answer.key:
        reasons = {**reasons, found.key: "holds effects that too many others could replace"}
    rows = [
        Rival(
            search.labels(key), search.error(key), key == answer.key,
            "" if key == answer.key else reasons.get(key, "tried against the chosen ones"),
        )
        for key in search.tried
    ]  # fmt: skip
    return tuple(sorted(rows, key=lambda row: (not row.chosen, row.error))[:EVIDENCE])
