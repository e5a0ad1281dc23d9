"""Measured logs of every kind as trajectories in SI units."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from residual.angles import with_whole_turns
from residual.logs.checks import Finding, Signal, check_rate
from residual.logs.layout import LogFormat, check_layout, named_column
from residual.logs.overflow import continued
from residual.logs.plausible import check_plausible
from residual.logs.runs import runs_of
from residual.logs.slower import filled
from residual.logs.sources import matching, open_log
from residual.logs.table import LogError
from residual.logs.timing import Run, report_sampling, tidy
from residual.trajectories import Trajectory
from sims.simulator import Channel


@dataclasses.dataclass(frozen=True)
class LogData:
    """What was read: the trajectories, and what there is to know about their quality."""

    trajectories: tuple[Trajectory, ...]
    findings: tuple[Finding, ...]

    def __repr__(self) -> str:
        rows = sum(len(run.times) for run in self.trajectories)
        count, told = len(self.trajectories), len(self.findings)
        return f"LogData({count} trajectories, {rows} samples, {told} findings)"


def read_logs(
    paths: Any,
    state_channels: Sequence[Channel],
    action_channels: Sequence[Channel],
    columns: LogFormat | None = None,
) -> LogData:
    """Read log files into trajectories whose columns are the simulator's channels, in SI.

    Repeated times are dropped, trajectories are cut at gaps and where an action is missing,
    angles are unwrapped, counters that overflowed go on, and each such repair is reported as a
    finding. Nothing is resampled or smoothed.

    Args:
        paths: One or several files (``.csv .txt .tsv .dat .log``, ``.parquet .pq``, ``.npz``,
            ``.mcap``, ``.h5 .hdf5``), folders of LeRobot and Minari data sets, data frames, or
            arrays by name. A pattern (``logs/*.csv``) stands for the files that match.
        state_channels: Of the simulator; those of kind ``"memory"`` are never in a log.
        action_channels: Of the simulator.
        columns: The layout of the files.

    Returns:
        Trajectories in the order of files and rows, and findings.

    Raises:
        LogError: A file or the layout is not usable; one line names file, row, column and fix.
    """
    alone = isinstance(paths, str | Path | Mapping) or hasattr(paths, "columns")
    paths = matching([paths] if alone else list(paths))
    columns = columns or LogFormat()
    channels = [c for c in state_channels if c.kind != "memory"]
    if not paths:
        raise LogError("no log files, expected at least one")
    check_layout(columns, channels, action_channels)
    findings: list[Finding] = []
    runs: list[Run] = []
    # What a broken file makes of its numbers is caught by their checks, not by numpy's warnings.
    with np.errstate(all="ignore"):
        for number, path in enumerate(paths, start=1):
            table, layout = open_log(path, number, columns, channels, action_channels, findings)
            if table.cut_off:
                says = "The last row is cut off and was left out."
                findings.append(Finding("cut_off", str(path), says))
            if table.headers:
                says = f"The header stands there {table.headers} times more, and was left out."
                findings.append(Finding("headers", str(path), says))
            only = len(paths) == 1
            runs += runs_of(table, layout, channels, action_channels, findings, only)
        _refuse_nowhere(runs, channels, columns)
        runs = [filled(run, action_channels, findings) for run in runs]
        runs = tidy(
            runs, columns.gap, columns.minimum_samples, findings, [c.name for c in channels]
        )
        runs = continued(runs, channels, columns, findings)
        findings += _constant_actions(runs, action_channels, columns)
        findings += _check_files(runs, channels, columns)
        findings += report_sampling(runs)
        trajectories = tuple(_trajectory(run, state_channels, channels, findings) for run in runs)
    findings += _unmeasured(channels, runs)
    return LogData(trajectories, tuple(findings))


def _refuse_nowhere(runs: Sequence[Run], channels: Sequence[Channel], columns: LogFormat) -> None:
    """Refuse a state that the layout gives a column, and that has no value in any file."""
    for index, channel in enumerate(channels):
        if channel.name not in columns.states or not runs:
            continue
        if not any(np.isfinite(run.states[:, index]).any() for run in runs):
            column = named_column(columns.states[channel.name], channel.name)
            raise LogError(
                f"no value at all for {channel.name!r} in any file, expected numbers; leave the "
                "channel out if it was not measured",
                column=column.column,
            )


def _constant_actions(
    runs: Sequence[Run], channels: Sequence[Channel], columns: LogFormat
) -> list[Finding]:
    """Inputs that never change, which mostly are a wrong column, but for those that were said to be
    constant."""
    findings = []
    for index, channel in enumerate(channels):
        column = named_column(columns.actions.get(channel.name, channel.name), channel.name)
        values = np.concatenate([run.actions[:-1, index] for run in runs] or [np.zeros(0)])
        if column.value is None and values.size and np.ptp(values) == 0:
            says = (
                f"It is {values[0]:g}{channel.unit_text} in all {len(values)} samples: if it was "
                "not held there, check the column. What it does is like a constant push."
            )
            findings.append(Finding("constant", channel.name, says, severity="warning"))
    return findings


def _check_files(
    runs: Sequence[Run], channels: Sequence[Channel], columns: LogFormat
) -> list[Finding]:
    """Check the numbers of every file.

    Raises:
        LogError: One of them is in other units. Where not all are, so is said: a unit is set for
            every file.
    """
    findings: list[Finding] = []
    wrong: dict[Path, str] = {}
    paths = list(dict.fromkeys(run.path for run in runs))
    for path in paths:
        of_file = [run for run in runs if run.path == path]
        try:
            findings += _check_numbers(path, of_file, channels, columns)
        except ValueError as error:
            wrong[path] = str(error)
    if not wrong:
        return findings
    path, says = next(iter(wrong.items()))
    if len(wrong) < len(paths):
        right = len(paths) - len(wrong)
        says += (
            f"; {right} of {len(paths)} files look right as they are: if so, convert the others, "
            "since a unit is set for all"
        )
    raise LogError(says, path)


def _check_numbers(
    path: Path, runs: Sequence[Run], channels: Sequence[Channel], columns: LogFormat
) -> list[Finding]:
    """Compare the rates of one file with its positions, and its angles with what is plausible."""
    findings = []
    signals = {}
    for index, channel in enumerate(channels):
        column = named_column(columns.states.get(channel.name, channel.name), channel.name)
        measured = [(run.times, run.states[:, index]) for run in runs]
        if any(np.isfinite(values).any() for _, values in measured):
            signals[channel.name] = Signal(channel, column.column, column.unit, measured)
    rates = {channel.rate_of: channel for channel in channels if channel.kind == "rate"}
    for signal in signals.values():
        position = signals.get(signal.channel.rate_of or "")
        if signal.channel.kind == "rate" and position is not None:
            findings += check_rate(position, signal, path.name)
    for name, signal in signals.items():
        rate = rates.get(name, signal.channel)
        declared = rate.scale if rate.kind == "rate" and rate.scale != 1.0 else None
        check_plausible(signal, declared)
    return findings


def _trajectory(
    run: Run, states: Sequence[Channel], channels: Sequence[Channel], findings: list[Finding]
) -> Trajectory:
    """A run with its angles unwrapped, one column for every state channel."""
    matrix = np.full((len(run.times), len(states)), np.nan)
    matrix[:, [list(states).index(channel) for channel in channels]] = run.states
    going_on = with_whole_turns(matrix, run.times, states)
    for column, channel in enumerate(states):
        known = np.isfinite(matrix[:, column])
        turns = np.diff(going_on[known, column] - matrix[known, column])
        jumps = int((np.abs(turns) > np.pi).sum())
        if jumps:
            says = f"{channel.name} jumped by whole turns {jumps} times and was unwrapped."
            findings.append(Finding("unwrapped", run.name, says, {"jumps": jumps}))
    return Trajectory(run.name, run.times, going_on, run.actions[:-1], converted=run.converted)


def _unmeasured(channels: Sequence[Channel], runs: Sequence[Run]) -> list[Finding]:
    seen = np.any([np.isfinite(run.states).any(axis=0) for run in runs], axis=0)
    return [
        Finding("unmeasured", channel.name, f"{channel.name} was not measured.")
        for channel, there in zip(channels, seen, strict=True)
        if not there
    ]
