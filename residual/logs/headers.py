"""Columns found by their headers: named like a channel, with or without a unit in brackets."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Collection, Mapping, Sequence

from residual.logs.checks import Finding
from residual.logs.layout import Column, named_column
from residual.logs.table import LogError, Table
from residual.logs.units import find_unit
from sims.simulator import Channel

TIME = Channel("time", "s", "other")

#: Last words of names of times that say what they count in.
_IN_NAME = {
    **dict.fromkeys(("ms", "msec", "millis", "milliseconds"), "ms"),
    **dict.fromkeys(("us", "usec", "micros", "microseconds"), "us"),
    **dict.fromkeys(("ns", "nsec", "nanoseconds"), "ns"),
    **dict.fromkeys(("min", "mins", "minute", "minutes"), "min"),
    **dict.fromkeys(("h", "hr", "hrs", "hour", "hours"), "h"),
    **dict.fromkeys(("day", "days"), "day"),
}
_WITH_UNIT = re.compile(r"(?P<name>.*\S)\s*(\[(?P<square>[^\]]*)\]|\((?P<round>[^)]*)\))")


def columns_of(
    table: Table,
    given: Mapping[str, str | int | Column],
    channels: Sequence[Channel],
    findings: list[Finding],
) -> dict[str, Column]:
    """The column of every channel that a file holds.

    Args:
        table: The file.
        given: What the layout says; if it says anything, nothing else counts.
        channels: That may be in the file.
        findings: What was converted because a header says so is added here.

    Raises:
        LogError: A header has the name of a channel and another quantity's unit, or two have it.
    """
    if given:
        said = {name: named_column(column, name) for name, column in given.items()}
        for channel in channels:
            if channel.name in said:
                findings += _unit_unsaid(table, said[channel.name], channel)
        return said
    found = {channel.name: _named_like(table, channel, findings) for channel in channels}
    taken = {column.column for column in found.values() if column is not None}
    for channel in channels:
        if found[channel.name] is None:
            found[channel.name] = _named_like(table, channel, findings, taken, str.casefold)
    return {name: column for name, column in found.items() if column is not None}


def time_column(table: Table, given: str | int | Column, findings: list[Finding]) -> Column:
    """The column of the times; of the default name also with a unit, and in capitals.

    Raises:
        LogError: Nothing is named so, or two columns are.
    """
    if given != TIME.name:
        said = named_column(given, TIME.name)
        findings += _unit_unsaid(table, said, TIME)
        return said
    found = _named_like(table, TIME, findings)
    found = found or _named_like(table, TIME, findings, spelt=str.casefold)
    if found is None:
        raise LogError(
            f"no column 'time', the file has {table.listed}; say which one it is, as "
            "time: {column: NAME, unit: s}, or, if it holds no times, the seconds between its "
            "samples, as period: 0.01, with --columns FILE",
            table.path,
        )
    return found


def _named_like(
    table: Table,
    channel: Channel,
    findings: list[Finding],
    taken: Collection[str | int] = (),
    spelt: Callable[[str], str] = str,
) -> Column | None:
    """The column that is named like a channel, if any, but for those that are taken.

    Args:
        spelt: What of a name counts.
    """
    fits = []
    for header in table.names:
        plain = str(header).strip()
        if header in taken:
            continue
        if spelt(plain) == spelt(channel.name):
            return _told(table, Column(header), channel, findings)
        name, stated = _parted(plain)
        if stated is not None and spelt(name) == spelt(channel.name):
            fits.append(Column(header, stated))
    if not fits:
        return None
    if len(fits) > 1:
        raise LogError(
            f"{' and '.join(repr(c.column) for c in fits)} are both named like {channel.name!r}; "
            "say which it is, with --columns FILE",
            table.path,
        )
    (column,) = fits
    try:
        unit = find_unit(column.unit, channel.unit)
    except ValueError as error:
        raise LogError(
            f"{error}; or say which column {channel.name!r} is, with --columns FILE",
            table.path,
            column=column.column,
        ) from None
    if unit != (1.0, 0.0):
        says = f"Column {column.column!r} was converted to {channel.unit}."
        findings.append(Finding("unit", table.path.name, says))
    return _told(table, column, channel, findings)


def _parted(header: str) -> tuple[str, str | None]:
    """A header's name, and the unit in brackets behind it; None if there are none."""
    match = _WITH_UNIT.fullmatch(header)
    if match is None:
        return header, None
    unit = match["square"] if match["round"] is None else match["round"]
    return match["name"], unit.strip()


def _unit_unsaid(table: Table, column: Column, channel: Channel) -> list[Finding]:
    """What is to be said of a column map without a unit where the header has another one.

    Of times also if their name ends in one, as ``t_min`` does.
    """
    header = str(column.column)
    if column.unit or (column.scale, column.offset) != (1.0, 0.0) or column.value is not None:
        return []
    _, unit = _parted(header)
    if unit is None and channel is TIME:
        unit = _IN_NAME.get(re.split(r"[\W_]+", header.strip())[-1].casefold(), "")
    with contextlib.suppress(ValueError):
        if find_unit(unit or "", channel.unit) != (1.0, 0.0):
            says = (
                f"Column {header!r} is read in {channel.unit}, since the column map names it "
                f"and no unit: say `unit: {unit}` if it counts in {unit}, or "
                f"`unit: {channel.unit}` if it does not."
            )
            return [Finding("unit", table.path.name, says, severity="warning")]
    return []


def _told(table: Table, column: Column, channel: Channel, findings: list[Finding]) -> Column:
    """A column, and what is to be said if it is spelt otherwise than its channel."""
    if channel.name not in str(column.column):
        says = f"Column {column.column!r} was taken for {channel.name!r}."
        findings.append(Finding("named", table.path.name, says))
    return column
