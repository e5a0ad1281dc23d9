"""What was recorded: looked at for faults, and settled how it is compared with the simulator."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from residual.gap.data.copies import shared
from residual.gap.data.examine import examine
from residual.gap.data.excerpt import excerpt
from residual.gap.data.scales import in_measured_scales
from residual.gap.preparation.horizon import held_by_records, usual_horizon
from residual.gap.preparation.numerics import stride_for
from residual.gap.preparation.prepare import Prepared, prepare
from residual.gap.preparation.suited import beyond_noise, horizon_of_windows, needs_closer_rows
from residual.logs.checks import Finding
from residual.trajectories import Trajectory
from sims.host import HostSimulator


@dataclasses.dataclass(frozen=True)
class Log:
    """What was recorded, looked at.

    Attributes:
        simulator: The nominal one, for the motion that the log shows.
        recorded: All runs, without what is faulty in them.
        runs: Of those the stretches that are searched.
        horizon: Length of forecasts in s.
        by_user: Whether the user chose the horizon, so that it stays.
        apart: Runs that are set aside, without what is faulty in them or measured there only.
        findings: What was found about the data.
        left_out: What of the data is not searched, in words.
        cut_off: Channels that the simulator cuts off within what was recorded of them.
        rescaled: Part by which a position moves more than the integral of its rate, which was put
            on its scale, by name.
    """

    simulator: HostSimulator
    recorded: Sequence[Trajectory]
    runs: Sequence[Trajectory]
    horizon: float
    by_user: bool
    apart: Sequence[Trajectory]
    findings: list[Finding]
    left_out: list[str]
    cut_off: tuple[str, ...] = ()
    rescaled: Mapping[str, float] = dataclasses.field(default_factory=dict)

    def at(self, horizon: float) -> Log:
        """The same for forecasts of another length, which want other rows."""
        runs, left_out = excerpt(self.recorded, stride_for(self.recorded, horizon))
        return dataclasses.replace(self, runs=runs, horizon=horizon, left_out=left_out)

    def read_as(self, change: Callable[[Sequence[Trajectory]], Sequence[Trajectory]]) -> Log:
        """The same with all runs, those set aside too, read otherwise."""
        recorded, runs, apart = map(change, (self.recorded, self.runs, self.apart))
        return dataclasses.replace(self, recorded=recorded, runs=runs, apart=apart)


def look(
    simulator: HostSimulator,
    trajectories: Sequence[Trajectory],
    held: Sequence[Trajectory],
    horizon: float | None,
    tell: Callable[[str], None],
) -> Log:
    """Find faults of the data, and how far forecasts go if the user does not say."""
    examined = examine(simulator, trajectories)
    findings = list(examined.findings)
    apart, more = _set_aside(simulator, held, examined.trajectories)
    known = {one.words for one in findings}
    findings += [
        dataclasses.replace(one, where=f"records set aside: {one.where}")
        for one in more
        if one.words not in known
    ]
    simulator = simulator.for_motion([run.states for run in [*examined.trajectories, *apart]])
    findings += [
        Finding(
            "copy",
            copy.name,
            f"is set aside, and holds samples of {first.name}, which is fitted: what is said of "
            "records set aside is no test",
        )
        for copy, first in shared(held, trajectories)[:1]
    ]
    every = examined.trajectories
    simulator = in_measured_scales(simulator, every)
    length = (
        held_by_records(simulator, every, horizon) if horizon else usual_horizon(simulator, every)
    )
    cut = dict.fromkeys(one.where for one in examined.findings if one.kind == "unanswered")
    rescaled = {
        one.where: one.numbers["scale"] - 1 for one in examined.findings if one.kind == "kinematics"
    }
    log = Log(
        simulator, every, every, length, horizon is not None, apart, findings, [], tuple(cut),
        rescaled,
    )  # fmt: skip
    log = log.at(length)
    for says in [*(one.words for one in findings), *log.left_out]:
        tell(says)
    return log


def _set_aside(
    simulator: HostSimulator, held: Sequence[Trajectory], fitted: Sequence[Trajectory]
) -> tuple[list[Trajectory], Sequence[Finding]]:
    """Runs that are set aside, with the channels that were measured in the others, and what was
    found about them."""
    if not held:
        return [], []
    try:
        examined = examine(simulator, held)
    except ValueError as error:
        raise ValueError(f"records set aside: {error}") from None
    known = np.any([np.isfinite(run.states).any(axis=0) for run in fitted], axis=0)
    apart = [
        dataclasses.replace(run, states=np.where(known, run.states, np.nan))
        for run in examined.trajectories
    ]
    if not any(np.isfinite(run.states).any() for run in apart):
        names = [
            c.name for c, there in zip(simulator.physical_channels, known, strict=True) if there
        ]
        raise ValueError(
            f"records set aside: none of them measures {' or '.join(names)}, which the others "
            "measure; give records with these channels"
        )
    return apart, examined.findings


def settle(simulator: HostSimulator, log: Log, tell: Callable[[str], None]) -> tuple[Log, Prepared]:
    """Windows, weights and numerics, from the nominal simulator alone.

    Args:
        simulator: The nominal one, with its inputs held as they shall be.
        log: What was recorded.
        tell: Progress.
    """
    tell("fitting the nominal simulator")
    prepared = prepare(simulator, log.runs, log.horizon)
    if not log.by_user and not simulator.has_contacts:
        if needs_closer_rows(log.runs, prepared):
            log = log.at(horizon_of_windows(prepared))
            tell(f"windows end early, where motion is unstable: rows for {log.horizon:.3g} s")
            prepared = prepare(simulator, log.runs, log.horizon)
        prepared = beyond_noise(simulator, log.runs, prepared)
        log = dataclasses.replace(log, horizon=prepared.horizon)
    return log, prepared
