"""The pipeline: data, numerics, search, choice, confirmation, verdict."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from residual.gap.aliases import aliases, representatives
from residual.gap.answer import confirm, judged_apart, matters, summed_up, told
from residual.gap.candidates import Candidate, candidates
from residual.gap.confirmation import CLEARLY
from residual.gap.conventions import otherwise
from residual.gap.data import examine
from residual.gap.excerpt import excerpt
from residual.gap.explain import Explanation, explain
from residual.gap.free_parameters import better, worth_freeing
from residual.gap.horizon import usual_horizon
from residual.gap.known import KNOWN
from residual.gap.lone import explains_the_rest, lone_stretch
from residual.gap.numerics import (
    fits_better,
    forecast_error,
    held_as,
    held_otherwise,
    how_held,
    stride_for,
)
from residual.gap.prepare import Prepared, prepare
from residual.gap.result import GapResult
from residual.gap.search import Search
from residual.gap.smooth import LEAD, SmoothFitter
from residual.gap.suited import beyond_noise, horizon_of_windows, needs_closer_rows
from residual.gap.twins import exact_twins, with_twins
from residual.gap.workers import workers
from residual.trajectories import Trajectory
from sims.contract import refuse_unsound
from sims.effects.base import Effect
from sims.host import HostSimulator
from sims.loading import LIBRARY, chosen_effects
from sims.simulator import Hold

Array = NDArray[np.float64]

#: Part of the time budget after which nothing new is tried.
SEARCHING = 0.7


def find_gap(
    simulator: HostSimulator,
    trajectories: Sequence[Trajectory],
    *,
    held: Sequence[Trajectory] = (),
    tolerance: float | None = None,
    effects: Iterable[Effect | str | Mapping[str, Any]] | None = None,
    hold: Hold | Mapping[str, Hold] | None = None,
    measured_input: bool = False,
    horizon: float | None = None,
    parameter_tolerance: float = KNOWN,
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
        effects: Effects that may be missing, as objects or by name (``sims.loading.
            chosen_effects``); by default all that the simulator can host.
        hold: How inputs run between samples, ``"zero"`` (held, as commands are) or ``"linear"``
            (straight to the next, as most measured inputs are), for all or by input; by default
            as the channels say, unless what is found fits clearly better the other way.
        measured_input: True if the logged inputs were measured at the actuator's output; what
            happens before that (dead zone, saturation, lag) is then no candidate.
        horizon: Forecast length in seconds; by default a third of the usual period of the motion,
            see ``residual.gap.horizon``.
        parameter_tolerance: How well the simulator's parameters are known, as a share of each: an
            effect is certain only if they cannot stand in for it within that, and its interval
            allows for them. 0 takes them for exact, so that intervals are of the data alone.
        minutes: Budget of processor time, so that a busy machine finds the same: the search for
            further explanations ends in time. Confirming may take as long again.
        n_jobs: Processes for a simulator that steps row by row.
        progress: Called with a line of text now and then.

    Returns:
        The verdicts and everything behind them.

    Raises:
        ValueError: There are no trajectories, nothing was measured, samples are too rare, the
            simulator is unsound (``sims.contract``) or returns values that are not finite, or a
            position of a system that strikes the ground was not measured.
    """
    refuse_unsound(simulator)
    clock = Clock()
    tell = progress or (lambda _: None)
    over = time.process_time() + 60 * minutes
    until, at_last = over - 60 * minutes * (1 - SEARCHING), over + 60 * minutes
    offered = chosen_effects(simulator, [LIBRARY] if effects is None else list(effects))
    if measured_input:
        offered = tuple(e for e in offered if not e.upstream_of_sensor)
    examined = examine(simulator, trajectories)
    runs = examined.trajectories
    simulator = simulator.for_motion([run.states for run in [*runs, *held]])
    quality = [f"{finding.where} {finding.says}".strip() for finding in examined.findings]
    chosen_by_user = horizon is not None
    horizon = horizon or usual_horizon(simulator, runs)
    runs, left_out = excerpt(runs, stride_for(runs, horizon))
    for says in [*quality, *left_out]:
        tell(says)
    tell("looking for effects that move alike")
    groups, sets = aliases(simulator, offered, runs)
    kept = representatives(simulator, offered, groups)
    named = {str(effect): effect for effect in offered}

    def explained(
        simulator: HostSimulator,
        ready: Prepared,
        beside: Sequence[Candidate] = (),
        earlier: Search | None = None,
    ) -> Explanation:
        free = {candidate.label for candidate in beside}
        pool = ready.pool(candidates(simulator, kept, ready.fitter.samples))
        pool = [candidate for candidate in pool if candidate.label not in free]
        others = {label: effect for label, effect in named.items() if label not in free}
        twins = exact_twins(simulator, ready.fitter.samples, groups, others)
        lead = 0.0 if simulator.has_contacts else ready.horizon * LEAD / (1 - LEAD)
        begun = f" begun from {lead:.3g} s before" if lead else ""
        ahead = f"forecasts over {ready.horizon:.3g} s{begun}"
        tell(f"{len(ready.fitter.blocks)} blocks of data, {ahead}, {len(pool)} candidate effects")
        tell("screening them")
        return explain(
            simulator, pool, ready.fitter, ready.floor, ready.weigh, ready.effort, tell, until,
            beside, earlier, twins,
        )  # fmt: skip

    with workers(n_jobs):
        simulator = held_as(simulator, hold)
        clock.lap("read")
        tell("fitting the nominal simulator")
        prepared = prepare(simulator, runs, horizon)
        if not chosen_by_user and not simulator.has_contacts:
            if needs_closer_rows(runs, prepared):
                horizon = horizon_of_windows(prepared)
                tell(f"windows end early, where motion is unstable: rows for {horizon:.3g} s")
                every = examined.trajectories
                runs, left_out = excerpt(every, stride_for(every, horizon))
                prepared = prepare(simulator, runs, horizon)
            prepared = beyond_noise(simulator, runs, prepared)
            horizon = prepared.horizon
        conventions = None
        if isinstance(prepared.fitter, SmoothFitter):
            conventions = otherwise(simulator, prepared.fitter)
        if conventions is not None:
            tell(f"does the log count otherwise, by {' or '.join(conventions.changes)}?")
        quality += left_out
        found = explained(simulator, prepared)
        other = held_otherwise(simulator) if hold is None else None
        if other is not None and fits_better(found.search, found.key, other):
            tell("inputs held the other way fit better: once more so")
            ready = prepare(other, runs, horizon)
            again = explained(other, ready)
            if clearly_better(again, found):
                prepared, found = ready, again
                quality.append(
                    f"inputs were taken to {how_held(other)}: the data fit better so; set hold to "
                    "say otherwise"
                )
            elif again.search.late:
                quality.append(
                    f"the data fit better with inputs taken to {how_held(other)}, but there was no "
                    "time to search so: set hold to say which it is, or give more --minutes"
                )
        clock.lap("search")
        tell("confirming")
        asked = matters(found, tolerance)
        answer = confirm(found, groups, asked, parameter_tolerance, at_last)
        stretch = lone_stretch(answer) if asked else None
        if stretch is not None:
            left_out = False
            if time.process_time() < until:
                tell("once more without a stretch that nothing explains")
                ready = prepare(found.search.simulator, stretch.cut_from(runs), horizon)
                again = explained(found.search.simulator, ready)
                second = confirm(again, groups, asked, parameter_tolerance, at_last)
                if left_out := explains_the_rest(second):
                    prepared, found, answer = ready, again, second
            quality.append(stretch.says(left_out))
        beside = worth_freeing(answer, parameter_tolerance) if asked else []
        if beside and time.process_time() > over:
            quality.append(
                "parameters within their tolerance may hide what is missing, or explain some of "
                "what is left: there was no time to look, give more --minutes"
            )
        elif beside:
            tell("once more with parameters free within their tolerance")
            again = explained(found.search.simulator, prepared, beside, found.search)
            second = confirm(again, groups, asked, parameter_tolerance, at_last)
            if better(second, answer):
                answer = second
        answer = dataclasses.replace(
            answer, claims=with_twins(answer.found.search, answer.key, answer.claims)
        )
        clock.lap("confirm")
        table = summed_up(answer)
        apart = None
        if held:
            others, _ = excerpt(examine(simulator, held).trajectories, stride_for(held, horizon))
            apart = judged_apart(answer, prepared, others, table)
        clock.lap("forecast")
    result = told(answer, table, apart, sets, tolerance, quality, clock.laps)
    return dataclasses.replace(result, conventions=conventions)


def clearly_better(one: Explanation, other: Explanation) -> bool:
    """Whether one explanation's forecasts are so much better that the other's are excluded."""
    errors = [forecast_error(found.search, found.key) for found in (one, other)]
    return CLEARLY**2 * errors[0] < errors[1]


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
