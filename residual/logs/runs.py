"""From the table of a file to its runs: units, trajectories, the time that is asked for."""

from __future__ import annotations

import difflib
from collections.abc import Container, Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.logs.checks import Finding
from residual.logs.headers import TIME, columns_of, time_column
from residual.logs.layout import Column, LogFormat
from residual.logs.table import LogError, Table
from residual.logs.timing import Run
from residual.logs.units import Unit, find_unit
from sims.simulator import Channel

Array = NDArray[np.float64]

#: Likeness of two names from which on one may be the other, misspelt.
NEAR = 0.8
# Beyond it, in SI, sums of squares lose all meaning; nanoseconds since 1970 are well below.
_LARGEST = 1e15


def runs_of(
    table: Table,
    columns: LogFormat,
    states: Sequence[Channel],
    actions: Sequence[Channel],
    findings: list[Finding],
    alone: bool = True,
) -> Iterator[Run]:
    """The trajectories of one file as they were recorded, in SI.

    Args:
        table: The file.
        columns: Its layout.
        states: State channels that a log can hold.
        actions: Action channels.
        findings: Converted columns, and trajectories that ``start`` and ``stop`` leave out, are
            added here.
        alone: Whether there is no other file, where a state that has no value here has some.

    Raises:
        LogError: A column is missing or holds no numbers, or the time goes backwards.
    """
    found = columns_of(table, columns.states, states, findings)
    inputs = columns_of(table, columns.actions, actions, findings)
    if not found:
        wanted = ", ".join(repr(channel.name) for channel in states)
        raise LogError(
            f"no column is named like a state of the simulator ({wanted}), the file has "
            f"{table.listed}; say under states which column is which, with --columns FILE",
            table.path,
        )
    lacking = [channel.name for channel in actions if channel.name not in inputs]
    if lacking:
        raise LogError(
            f"no column for action {lacking[0]!r}, the file has "
            f"{table.listed}; say under actions which column it is, or "
            "give it a constant value, with --columns FILE",
            table.path,
        )
    if not alone:
        _refuse_absent(table, found)
    time = time_column(table, columns.time, findings)
    if not columns.states:
        read = {str(column.column) for column in (*found.values(), *inputs.values(), time)}
        _tell_misspelt(table, [c.name for c in states if c.name not in found], read, findings)
    times = _si(table, time, TIME, columns.decimal)
    seen = [
        _si(table, found[channel.name], channel, columns.decimal)
        if channel.name in found
        else np.full(len(table), np.nan)
        for channel in states
    ]
    acted = [_si(table, inputs[channel.name], channel, columns.decimal) for channel in actions]
    needed = list(zip(actions, acted, strict=True))
    if alone or not any(np.isfinite(values).any() for values in seen):
        needed = [*zip(states, seen, strict=True), *needed]
    for channel, values in needed:
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
    if len(table) > 1 and np.nanmin(times) == np.nanmax(times):
        raise LogError(
            f"time is {np.nanmin(times):g} in every row, expected seconds that go on; say which "
            "column holds them, or, if none does, period: and the seconds between samples",
            table.path,
            column=time.column,
        )
    matrix = np.column_stack(seen)
    inputs_matrix = np.column_stack(acted) if acted else np.zeros((len(table), 0))
    converted = {
        channel.name: column.unit
        for channel in (*states, *actions)
        if (column := (found | inputs).get(channel.name))
        and column.unit
        and find_unit(column.unit, channel.unit) != Unit(1.0)
    }
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
                converted,
            )


def _tell_misspelt(
    table: Table, lacking: Sequence[str], read: Container[str], findings: list[Finding]
) -> None:
    """Tell of a column that is not read and is named nearly as a state that has none."""
    told = {finding.where for finding in findings if finding.kind == "misspelt"}
    unread = [str(name) for name in table.names if str(name) not in read]
    for name in lacking:
        near = difflib.get_close_matches(name, unread, 1, NEAR)
        if near and name not in told:
            says = (
                f"has no column of its name, but there is {near[0]!r}, which is not read: if it is "
                "that, say so under states, with --columns FILE"
            )
            findings.append(Finding("misspelt", name, says, {}, "warning"))


def _refuse_absent(table: Table, states: Mapping[str, Column]) -> None:
    """Refuse one of several files that lacks the column of a state."""
    for name, column in states.items():
        if column.column in (*table.names, *range(1, len(table.names) + 1)):
            continue
        try:
            table.values(column.column)
        except LogError as error:
            raise LogError(
                f"{error}; if {name!r} was not measured in this file, give it an empty column of "
                "that name, or leave the channel out of the map"
            ) from None


def _si(table: Table, column: Column, channel: Channel, decimal: str) -> Array:
    """One column in the unit of its channel, shape (n,); a missing value is NaN."""
    if column.value is not None:
        return np.full(len(table), column.value)
    try:
        unit = find_unit(column.unit, channel.unit)
    except ValueError as error:
        raise LogError(str(error), table.path, column=column.column) from None
    numbers = table.numbers(column.column, decimal, channel.name)
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
        values = [str(value) for value in wanted]
        chosen &= np.isin(texts, values)
        if not chosen.any():
            there = ", ".join(sorted(set(texts))[:12])
            raise LogError(
                f"no row holds {' or '.join(values)}, the column has {there}",
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
