"""Columns found by their headers: named like a channel, with or without a unit in brackets."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from residual.logs.checks import Finding
from residual.logs.layout import Column, named_column
from residual.logs.table import LogError, Table
from residual.logs.units import find_unit
from sims.simulator import Channel

TIME = Channel("time", "s", "other")

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
        return {name: named_column(column, name) for name, column in given.items()}
    found = {channel.name: _named_like(table, channel, findings) for channel in channels}
    return {name: column for name, column in found.items() if column is not None}


def time_column(table: Table, given: str | int | Column, findings: list[Finding]) -> Column:
    """The column of the times; of the default name also with a unit."""
    found = _named_like(table, TIME, findings) if given == TIME.name else None
    return found or named_column(given, TIME.name)


def _named_like(table: Table, channel: Channel, findings: list[Finding]) -> Column | None:
    if channel.name in table.columns:
        return Column(channel.name)
    fits = []
    for header in table.names:
        match = _WITH_UNIT.fullmatch(str(header).strip())
        if match and match["name"] == channel.name:
            unit = match["square"] if match["round"] is None else match["round"]
            fits.append(Column(header, unit.strip()))
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
    if (unit.factor, unit.offset) != (1.0, 0.0):
        says = f"Column {column.column!r} was converted to {channel.unit}."
        findings.append(Finding("unit", table.path.name, says))
    return column
