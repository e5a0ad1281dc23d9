"""Measured logs (CSV and the like, Parquet, NPZ) as trajectories in SI units."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from residual.log_checks import Finding, Signal, check_plausible, check_rate
from residual.log_format import Column, LogFormat, check_layout, named_column
from residual.log_tables import LogError, Table, read_table
from residual.log_timing import Run, report_sampling, tidy
from residual.trajectories import Trajectory
from residual.units import find_unit
from sims.simulator import Channel

__all__ = ["Column", "Finding", "LogData", "LogError", "LogFormat", "read_logs"]

Array = NDArray[np.float64]

# Beyond it, in SI, sums of squares lose all meaning; nanoseconds since 1970 are well below.
_LARGEST = 1e15


@dataclasses.dataclass(frozen=True)
class LogData:
    """What was read: the trajectories, and what there is to know about their quality."""

    trajectories: tuple[Trajectory, ...]
    findings: tuple[Finding, ...]


def read_logs(
    paths: Sequence[str | Path],
    state_channels: Sequence[Channel],
    action_channels: Sequence[Channel],
    columns: LogFormat | None = None,
) -> LogData:
    """Read log files into trajectories whose columns are the simulator's channels, in SI.

    Repeated times are dropped, trajectories are cut at gaps and where an action is missing,
    angles are unwrapped, and each such repair is reported as a finding. Nothing is resampled or
    smoothed.

    Args:
        paths: The files: ``.csv .txt .tsv .dat .log``, ``.parquet .pq`` or ``.npz``.
        state_channels: Of the simulator; those of kind ``"memory"`` are never in a log.
        action_channels: Of the simulator.
        columns: The layout of the files.

    Returns:
        Trajectories in the order of files and rows, and findings.

    Raises:
        LogError: A file or the layout is not usable; one line names file, row, column and fix.
    """
    columns = columns or LogFormat()
    channels = [c for c in state_channels if c.kind != "memory"]
    if not paths:
        raise LogError("no log files, expected at least one")
    check_layout(columns, channels, action_channels)
    findings: list[Finding] = []
    runs: list[Run] = []
    # What a broken file makes of its numbers is caught by their checks, not by numpy's warnings.
    with np.errstate(all="ignore"):
        for path in map(Path, paths):
            table = read_table(path, columns.delimiter, columns.header, columns.comment)
            if table.cut_off:
                says = "The last row is cut off and was left out."
                findings.append(Finding("cut_off", str(path), says))
            runs += _runs(table, columns, channels, action_channels, findings)
        runs = tidy(
            runs, columns.gap, columns.minimum_samples, findings, [c.name for c in channels]
        )
        _check_actions(runs, action_channels, columns)
        _check_numbers(runs, channels, columns, findings)
        findings += report_sampling(runs)
        trajectories = tuple(_trajectory(run, state_channels, channels, findings) for run in runs)
    findings += _unmeasured(channels, runs)
    return LogData(trajectories, tuple(findings))


def _layout(
    table: Table, given: Mapping[str, str | int | Column], channels: Sequence[Channel]
) -> dict[str, Column]:
    """The column of every channel that this file holds."""
    if given:
        return {name: named_column(column, name) for name, column in given.items()}
    return {c.name: Column(c.name) for c in channels if c.name in table.columns}


def _runs(
    table: Table,
    columns: LogFormat,
    states: Sequence[Channel],
    actions: Sequence[Channel],
    findings: list[Finding],
) -> Iterator[Run]:
    """The trajectories of one file as they were recorded, in SI."""
    found = _layout(table, columns.states, states)
    inputs = _layout(table, columns.actions, actions)
    if not found:
        wanted = ", ".join(repr(channel.name) for channel in states)
        have = ", ".join(map(repr, table.names[:12]))
        raise LogError(
            f"no column is named like a state of the simulator ({wanted}), the file has {have}; "
            "say under states which column is which",
            table.path,
        )
    lacking = [channel.name for channel in actions if channel.name not in inputs]
    if lacking:
        raise LogError(
            f"no column for action {lacking[0]!r}, the file has "
            f"{', '.join(map(repr, table.names[:12]))}; say under actions which column it is, or "
            "give it a constant value",
            table.path,
        )
    time = named_column(columns.time, "time")
    times = _si(table, time, Channel("time", "s", "other"), columns.decimal)
    seen = [
        _si(table, found[channel.name], channel, columns.decimal)
        if channel.name in found
        else np.full(len(table), np.nan)
        for channel in states
    ]
    acted = [_si(table, inputs[channel.name], channel, columns.decimal) for channel in actions]
    for channel, values in (*zip(states, seen, strict=True), *zip(actions, acted, strict=True)):
        column = (found | inputs).get(channel.name)
        if column is not None and not np.isfinite(values).any():
            raise LogError(
                f"no value at all for {channel.name!r}, expected numbers; leave the channel out "
                "if it was not measured",
                table.path,
                column=column.column,
            )
    if not np.isfinite(times).any():
        raise LogError("no time at all, expected seconds", table.path, column=time.column)
    matrix = np.column_stack(seen)
    inputs_matrix = np.column_stack(acted) if acted else np.zeros((len(table), 0))
    for label, rows in _groups(table, columns):
        for part in _resets(table, times, rows, columns.split_at_time_resets, time.column):
            inside = _between(times[part], columns.start, columns.stop)
            if len(inside) < min(len(part), columns.minimum_samples):
                says = f"Only {len(inside)} of {len(part)} samples lie between start and stop."
                findings.append(Finding("selection", f"{table.path.name} {label}".strip(), says))
                continue
            part = part[inside]
            yield Run(
                table.path,
                f"{table.path.name} {label}".strip(),
                table.rows[part],
                times[part],
                matrix[part],
                inputs_matrix[part],
            )


def _si(table: Table, column: Column, channel: Channel, decimal: str) -> Array:
    """One column in the unit of its channel, shape (n,); a missing value is NaN."""
    if column.value is not None:
        return np.full(len(table), column.value)
    try:
        unit = find_unit(column.unit, channel.unit)
    except ValueError as error:
        raise LogError(str(error), table.path, column=column.column) from None
    numbers = table.numbers(column.column, decimal)
    values = column.scale * (unit.factor * numbers + unit.offset) + column.offset
    wild = np.flatnonzero(~np.isnan(numbers) & ~(np.abs(values) < _LARGEST))
    if wild.size:
        raise LogError(
            f"found {numbers[wild[0]]:g}, which is beyond any measurement; correct the value or "
            "leave it empty",
            table.path,
            int(table.rows[wild[0]]),
            column.column,
        )
    return values


def _groups(table: Table, columns: LogFormat) -> list[tuple[str, NDArray[np.int64]]]:
    """Rows of every trajectory of a file, in the order of their first row, with its label."""
    chosen = np.ones(len(table), bool)
    for name, wanted in columns.only.items():
        texts = _texts(table, name)
        chosen &= np.isin(texts, [str(value) for value in wanted])
        if not chosen.any():
            there = ", ".join(sorted(set(texts))[:12])
            raise LogError(
                f"no row holds {' or '.join(wanted)}, the column has {there}",
                table.path,
                column=name,
            )
    rows = np.flatnonzero(chosen)
    if not columns.trajectory:
        return [("", rows)]
    labels = [_texts(table, name) for name in columns.trajectory]
    groups: dict[str, list[int]] = {}
    for row in rows:
        groups.setdefault(" ".join(texts[row] for texts in labels), []).append(int(row))
    return [(label, np.array(members)) for label, members in groups.items()]


def _texts(table: Table, column: str | int) -> list[str]:
    """A column as text; whole numbers without a point, so that 1.0 and 1 are one trajectory."""
    texts = []
    for value in table.values(column):
        try:
            number = float(value)
            texts.append(str(int(number)) if number.is_integer() else str(value))
        except (TypeError, ValueError):
            texts.append(str(value))
    return texts


def _resets(
    table: Table, times: Array, rows: NDArray[np.int64], split: bool, column: str | int
) -> list[NDArray[np.int64]]:
    """Rows split where the time goes backwards, which is an error unless ``split``."""
    known = rows[np.isfinite(times[rows])]
    back = np.flatnonzero(np.diff(times[known]) < 0) + 1
    if back.size and not split:
        here = known[back[0]]
        raise LogError(
            f"time goes backwards, from {times[known[back[0] - 1]]:g} s to {times[here]:g} s; sort "
            "the rows, or if a new run begins there set split_at_time_resets: true or name the "
            "trajectory column",
            table.path,
            int(table.rows[here]),
            column,
        )
    return np.split(rows, np.searchsorted(rows, known[back]))


def _between(times: Array, start: float | None, stop: float | None) -> NDArray[np.int64]:
    chosen = np.ones(len(times), bool)
    if start is not None:
        chosen &= times >= start
    if stop is not None:
        chosen &= times <= stop
    return np.flatnonzero(chosen)


def _check_actions(runs: Sequence[Run], channels: Sequence[Channel], columns: LogFormat) -> None:
    """Refuse logs in which an action never changes: they cannot tell what it does."""
    for index, channel in enumerate(channels):
        column = named_column(columns.actions.get(channel.name, channel.name), channel.name)
        values = np.concatenate([run.actions[:-1, index] for run in runs])
        if columns.allow_constant_action or column.value is not None or np.ptp(values) > 0:
            continue
        raise LogError(
            f"the action {channel.name!r} is {values[0]:g} {channel.unit} in all {len(values)} "
            "samples, expected one that changes; check the column, or if it is a run without "
            "input, such as a free decay, set allow_constant_action: true",
            runs[0].path,
            column=column.column,
        )


def _check_numbers(
    runs: Sequence[Run],
    channels: Sequence[Channel],
    columns: LogFormat,
    findings: list[Finding],
) -> None:
    """Compare rates with positions, and angles with what is plausible."""
    signals = {}
    for index, channel in enumerate(channels):
        column = named_column(columns.states.get(channel.name, channel.name), channel.name)
        measured = [(run.times, run.states[:, index]) for run in runs]
        if any(np.isfinite(values).any() for _, values in measured):
            signals[channel.name] = Signal(channel, column.column, column.unit, measured)
    rates = {channel.rate_of: channel for channel in channels if channel.kind == "rate"}
    try:
        for signal in signals.values():
            position = signals.get(signal.channel.rate_of or "")
            if signal.channel.kind == "rate" and position is not None:
                findings += check_rate(position, signal)
        for name, signal in signals.items():
            rate = rates.get(name, signal.channel)
            declared = rate.scale if rate.kind == "rate" and rate.scale != 1.0 else None
            check_plausible(signal, declared)
    except ValueError as error:
        raise LogError(str(error), runs[0].path) from None


def _trajectory(
    run: Run, states: Sequence[Channel], channels: Sequence[Channel], findings: list[Finding]
) -> Trajectory:
    """A run with its angles unwrapped, one column for every state channel."""
    matrix = np.full((len(run.times), len(states)), np.nan)
    for values, channel in zip(run.states.T, channels, strict=True):
        column = list(states).index(channel)
        matrix[:, column] = values
        known = np.isfinite(values)
        if channel.angle and known.any():
            matrix[known, column] = np.unwrap(values[known])
            jumps = int((np.abs(np.diff(values[known])) > np.pi).sum())
            if jumps:
                findings.append(
                    Finding(
                        "unwrapped",
                        run.name,
                        f"{channel.name} jumped by whole turns {jumps} times and was unwrapped.",
                        {"jumps": jumps},
                    )
                )
    return Trajectory(run.name, run.times, matrix, run.actions[:-1])


def _unmeasured(channels: Sequence[Channel], runs: Sequence[Run]) -> list[Finding]:
    seen = np.any([np.isfinite(run.states).any(axis=0) for run in runs], axis=0)
    return [
        Finding("unmeasured", channel.name, f"{channel.name} was not measured.")
        for channel, there in zip(channels, seen, strict=True)
        if not there
    ]
