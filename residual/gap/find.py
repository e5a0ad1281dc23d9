"""The pipeline: look, settle, search, confirm, judge."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import replace
from numbers import Integral, Real
from typing import Any

import numpy as np

from residual.gap.answer.answer import summed_up, told
from residual.gap.answer.apart import NOT_JUDGED, judged_apart
from residual.gap.answer.changing import changing, in_place
from residual.gap.answer.confirmed import matters
from residual.gap.answer.encoders import by_sensor_or_clock
from residual.gap.answer.ends import with_fitted_ends
from residual.gap.answer.form import rare_beside_much
from residual.gap.answer.late import nearly_in_sensors
from residual.gap.answer.out_of_proportion import out_of_proportion
from residual.gap.answer.periodic import periodic
from residual.gap.answer.records import explain_most, stands_for, unlike
from residual.gap.answer.table import lost
from residual.gap.clock import Clock, usual_minutes
from residual.gap.confirmation.numerics import times_better
from residual.gap.confirmation.swapped import swapped
from residual.gap.fitting.contract import Fitter
from residual.gap.inquiry import Inquiry
from residual.gap.log import look, settle
from residual.gap.model.workers import workers
from residual.gap.offered import Offered
from residual.gap.preparation.conventions import (
    beyond_scale,
    other_sign,
    otherwise,
    still_open,
    without_sign,
)
from residual.gap.preparation.horizon import other_length
from residual.gap.preparation.numerics import held_as
from residual.gap.readings.otherwise import read_otherwise
from residual.gap.readings.read import Asked, Read
from residual.gap.result import GapResult
from residual.gap.search.finals import on_more_windows
from residual.gap.search.known import KNOWN
from residual.logs import LogData
from residual.logs.checks import Finding
from residual.trajectories import Trajectory, converted_units, trajectories_of
from sims.contract import refuse_unsound
from sims.effects.base import Effect
from sims.host import HostSimulator
from sims.simulator import Hold, Simulator

#: Part of the rows that an answer rests on, below which that is told.
ENOUGH = 0.5


def find_gap(
    simulator: HostSimulator,
    trajectories: Trajectory | Iterable[Trajectory] | LogData,
    *,
    held_out: Trajectory | Iterable[Trajectory] | LogData = (),
    tolerance: float | None = None,
    effects: Effect | str | Iterable[Effect | str | Mapping[str, Any]] | None = None,
    hold: Hold | Mapping[str, Hold] | None = None,
    measured_input: bool | Collection[str] = False,
    horizon: float | None = None,
    parameter_tolerance: float = KNOWN,
    minutes: float | None = None,
    n_jobs: int = 1,
    progress: Callable[[str], None] | None = None,
) -> GapResult:
    """Find where a simulator and measured logs disagree, and name what is missing.

    Args:
        simulator: The nominal simulator.
        trajectories: Measured runs, or what ``read_logs`` returned; blocks of them are left out in
            turn to judge what is found.
        held_out: Runs that are used for the final table only; where the corrected simulator is
            worse on them, nothing is certain.
        tolerance: Forecast error that does not matter, in the unit of the first measured
            position; below it the verdict is "nothing that matters".
        effects: Effects that may be missing, as objects or by name (``sims.chosen.
            chosen_effects``); by default all that the simulator can host.
        hold: How inputs run between samples, ``"zero"`` (held, as commands are) or ``"linear"``
            (straight to the next, as most measured inputs are), for all or by input; by default
            as the channels say, unless what is found fits clearly better the other way.
        measured_input: True if the logged inputs were measured at the actuator's output, or names
            of those that were; what happens before that (dead zone, saturation, lag) is then no
            candidate.
        horizon: Forecast length in seconds; by default a third of the usual period of the motion,
            see ``residual.gap.preparation.horizon``.
        parameter_tolerance: How well the simulator's parameters are known, as a share of each: an
            effect is certain only if they cannot stand in for it within that, and its interval
            allows for them. 0 takes them for exact, so that intervals are of the data alone.
        minutes: Budget of processor time once the log is read, so that a busy machine finds the
            same: the search for further explanations ends in time. Confirming may take as long
            again, and a choice on more windows what it takes. By default 2, and 6 for what strikes
            the ground.
        n_jobs: Processes for a simulator that steps row by row.
        progress: Called with a line of text now and then.

    Returns:
        The verdicts and everything behind them.

    Raises:
        ValueError: There are no trajectories, nothing was measured (in those set aside: nothing
            that was measured in the others), samples are too rare, a setting is no number or beyond
            its range, the simulator hosts no effects, is unsound (``sims.contract``) or returns
            values that are not finite, or a position of a system that strikes the ground was not
            measured.
    """
    simulator = hosting(simulator)
    declared = {channel.name: channel.scale for channel in simulator.physical_channels}
    _refuse_settings(horizon, parameter_tolerance, minutes, n_jobs)
    runs, set_aside = trajectories_of(trajectories), trajectories_of(held_out)
    clock = Clock()
    tell = progress or (lambda _: None)
    log = look(simulator, runs, set_aside, horizon, tell)
    tell("looking for effects that move alike")
    offered = Offered.of(log, effects, measured_input)
    inquiry = Inquiry(offered, clock, tell)
    with workers(n_jobs):
        simulator = held_as(log.simulator, hold)
        clock.lap("read")

        log, prepared = settle(simulator, log, tell)
        clock.begin(minutes or usual_minutes(simulator))
        converted = converted_units(log.runs)
        conventions = otherwise(simulator, prepared.fitter, converted)
        conventions = conventions or without_sign(simulator, prepared.fitter)
        conventions = conventions or beyond_scale(simulator, prepared.fitter.samples, converted)
        if conventions is not None:
            tell(f"does the log count otherwise, by {' or '.join(conventions.changes)}?")

        found = inquiry.explained(simulator, prepared)
        read = Read(log, prepared, found, conventions=conventions)
        asks = Asked(simulator, inquiry.explained, tell)
        read = read_otherwise(read, asks, clock, hold_is_known=hold is not None)
        log, prepared, found = read.log, read.prepared, read.found
        conventions = read.conventions
        with clock.besides():
            prepared, found, on_more = on_more_windows(prepared, found, clock.confirm_until, tell)
        chosen = [found.search.candidates[number].effect for number in found.key]
        if conventions and not still_open(
            conventions, simulator, found.adequate, chosen, times_better(found.search, found.key)
        ):
            conventions = None
        clock.lap("search")

        tell("confirming")
        asked = matters(found, tolerance)
        known = inquiry.confirmed(log, prepared, found, asked, parameter_tolerance)
        answer = known.answer
        tell("do the records differ?")
        ask = asked and conventions is None and not clock.late
        differ = unlike(answer) if ask else ()
        over_time = changing(answer, known.in_vain) if ask else None
        over_time = with_fitted_ends(over_time, answer, log.runs, log.horizon)
        repeats = periodic(answer) if ask else None
        clock.lap("confirm")

        table, judged = summed_up(answer), NOT_JUDGED
        if log.apart:
            rested = any(run.before is not None for run in log.runs)
            judged = judged_apart(answer, known.prepared, log.apart, table, rested)
        either = swapped(answer.found.search, answer.key)
        rare = rare_beside_much(answer, offered.further)
        answer = replace(
            answer,
            claims=tuple(
                replace(
                    claim,
                    swapped=claim.number in either,
                    rare=claim.number in rare,
                    counted=conventions is not None
                    or by_sensor_or_clock(claim, answer.found.search, log.rescaled),
                    cut_off=bool(log.cut_off),
                    unlike=stands_for(answer, claim, differ),
                    drifts=claim.drifts or in_place(over_time, along_records=True),
                    other_law=claim.other_law or in_place(over_time, along_records=False),
                    refuted=judged.refuted,
                    helpless=claim.number in judged.helpless,
                )
                for claim in answer.claims
            ),
        )
        clock.lap("forecast")
    other = other_length(simulator, horizon, table.horizon_s) if horizon else []
    stretch = None if explain_most(differ) else known.stretch
    says = [*log.left_out, *other, *read.says, *on_more, *known.says]
    says += [stretch.says(left_out=False)] if stretch else []
    says += [*_searched(answer.found.search.fitter), *inquiry.untried(answer)]
    says += [*judged.says, *lost(answer.found.search, table), *out_of_proportion(answer)]
    quality = (*log.findings, *(Finding("search", "", one) for one in says))
    result = told(answer, table, judged.table, offered.sets, tolerance, quality, clock.laps)
    late = nearly_in_sensors(result.effects, answer.found.search)
    conventions = conventions or other_sign(simulator, result.effects)
    return replace(
        result, corrected=result.corrected.with_scales(declared), conventions=conventions,
        cut_off=log.cut_off, unlike=differ, changing=over_time, periodic=repeats,
        nearly_late=late, lone=None if stretch is None or stretch.beside else stretch,
    )  # fmt: skip


def hosting(simulator: Simulator) -> HostSimulator:
    """The simulator, if effects can be added to it.

    Raises:
        ValueError: It hosts none, or is unsound (``sims.contract``).
    """
    if isinstance(simulator, Simulator) and not isinstance(simulator, HostSimulator):
        raise ValueError(
            f"{type(simulator).__name__} cannot host effects: derive it from EquationOfMotion or "
            "FirstOrderSystem (sims.equations), or from HostSimulator (sims.host)"
        )
    refuse_unsound(simulator)
    return simulator


def _refuse_settings(horizon: Any, parameter_tolerance: Any, minutes: Any, n_jobs: Any) -> None:
    """Refuse numbers that are none, or mean nothing.

    Raises:
        ValueError: Names the setting.
    """
    for name, value, most, what in (
        ("horizon", 1.0 if horizon is None else horizon, np.inf, "seconds above 0"),
        ("minutes", 1.0 if minutes is None else minutes, np.inf, "minutes above 0"),
        ("parameter_tolerance", parameter_tolerance, 1.0, "a share up to 1, as 0.03 for 3 %"),
    ):
        number = isinstance(value, Real) and not isinstance(value, bool)
        least = 0.0 if name == "parameter_tolerance" else np.nextafter(0.0, 1.0)
        if not number or not least <= float(value) <= most:
            raise ValueError(f"{name} is {value!r}, expected {what}")
    if isinstance(n_jobs, bool) or not isinstance(n_jobs, Integral) or n_jobs < 1:
        raise ValueError(f"n_jobs is {n_jobs!r}, expected a number of processes, 1 or more")


def _searched(fitter: Fitter) -> list[str]:
    """What is to be said if windows hold less than half of the rows."""
    held, rows = int(fitter.blocks.windows.inside.sum()), len(fitter.samples)
    if held >= ENOUGH * rows:
        return []
    return [
        f"the answer rests on {held} of {rows} samples: {len(fitter.blocks)} blocks, spread evenly "
        "over how hard the records are driven"
    ]
