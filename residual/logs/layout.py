"""How log files are laid out: which column holds which channel, in which unit."""

from __future__ import annotations

import dataclasses
import difflib
from collections.abc import Sequence

import numpy as np

from residual.logs.table import LogError
from sims.simulator import Channel


@dataclasses.dataclass(frozen=True)
class Column:
    """Where a channel stands in a log, and how it becomes SI: ``scale * si(value) + offset``.

    Args:
        column: Name in the header, or position (1 is the first); empty means the channel's name.
        unit: Of the values in the file (``deg``, ``rpm``, ``mV``, ...); empty means the channel's
            own SI unit.
        scale: Applied after the unit; -1 turns the sign.
        offset: Added last, in SI (``3.14159`` if the log counts from hanging, the model from
            upright).
        value: For an action that was not logged: its constant value in SI, in place of a column.
    """

    column: str | int = ""
    unit: str = ""
    scale: float = 1.0
    offset: float = 0.0
    value: float | None = None


@dataclasses.dataclass(frozen=True)
class LogFormat:
    """How the log files are laid out; what is not said follows the simulator's channels.

    Args:
        time: Column of the sample times, by default in s.
        period: Seconds between samples of a log without times, such as a data set of episodes.
        states: Column by state channel; a channel that is left out was not measured. Empty: the
            columns that are named like channels.
        actions: Column by action channel. Empty: the columns that are named like the actions.
        trajectory: Columns whose values tell the trajectories of a file apart.
        split_at_time_resets: Begin a new trajectory where the time goes backwards.
        only: Use only rows in which a column holds one of the values listed, as text.
        start: Use samples from this time on, in s on the log's clock.
        stop: Use samples up to this time, in s on the log's clock.
        header: Whether the first row of a text file names the columns; without it, columns are
            given by position.
        delimiter: Of a text file: a character or ``comma``, ``semicolon``, ``tab``, ``blank``;
            ``auto`` looks at the first row.
        comment: Lines of a text file that begin with it are left out.
        skip: How many lines at the top of a text file to leave out.
        decimal: Decimal sign of a text file.
        gap: A trajectory is cut where samples are further apart than this many usual periods: the
            median step, or that of the longest tenth.
        minimum_samples: A trajectory with fewer is an error; a piece with fewer is left out.
    """

    time: str | int | Column = "time"
    period: float | None = None
    states: dict[str, str | int | Column] = dataclasses.field(default_factory=dict)
    actions: dict[str, str | int | Column] = dataclasses.field(default_factory=dict)
    trajectory: list[str | int] = dataclasses.field(default_factory=list)
    split_at_time_resets: bool = False
    only: dict[str, list[str | int]] = dataclasses.field(default_factory=dict)
    start: float | None = None
    stop: float | None = None
    header: bool = True
    delimiter: str = "auto"
    comment: str = "#"
    skip: int = 0
    decimal: str = "."
    gap: float = 5.0
    minimum_samples: int = 5


def check_layout(columns: LogFormat, states: Sequence[Channel], actions: Sequence[Channel]) -> None:
    """Refuse settings that no file could satisfy.

    Args:
        columns: The settings.
        states: State channels that a log can hold.
        actions: Action channels.

    Raises:
        LogError: A channel is unknown, or a setting is not usable.
    """
    if not isinstance(columns, LogFormat):
        raise LogError(
            f"columns is {columns!r}, expected a LogFormat, as LogFormat(states={{...}}); a file "
            "with one is for --columns of the command"
        )
    for kind, channels, own in (("state", states, False), ("action", actions, True)):
        strange = [channel.name for channel in channels if (channel.kind == "input") != own]
        if strange:
            what = "is no input" if own else "is an input"
            raise LogError(
                f"{kind} channels: {strange[0]!r} {what}; expected the simulator's state_channels, "
                "then its action_channels"
            )
    for kind, given, channels in (
        ("state", columns.states, states),
        ("action", columns.actions, actions),
    ):
        names = [channel.name for channel in channels]
        for name, column in given.items():
            if name not in names:
                near = difflib.get_close_matches(name, names, 1)
                hint = f"; did you mean {near[0]!r}?" if near else ""
                raise LogError(
                    f"columns.{kind}s: the simulator has no {kind} channel {name!r}, it has "
                    f"{', '.join(map(repr, names)) or 'none'}{hint}"
                )
            if isinstance(column, Column) and not (np.isfinite(column.scale) and column.scale):
                raise LogError(
                    f"{kind} {name!r} has scale {column.scale!r}: that makes one value of all, "
                    "expected a factor, such as 0.001 or -1"
                )
            value = column.value if isinstance(column, Column) else None
            if value is not None and (kind == "state" or not np.isfinite(value)):
                raise LogError(
                    f"{kind} {name!r} has value {value!r}: only an action can have a constant "
                    "value in place of a column, and it must be finite"
                )
    _refuse_shared(columns, states, actions)
    named = [named_column(c, "") for c in (*columns.states.values(), *columns.actions.values())]
    named = [named_column(columns.time, ""), *(c for c in named if c.value is None)]
    if not columns.header and any(isinstance(column.column, str) for column in named):
        raise LogError(
            "header: false leaves columns without names: give time, states and actions by "
            "position (1 is the first)"
        )
    if columns.skip < 0:
        raise LogError(f"skip is {columns.skip}, expected the number of lines above the table")
    for setting, said, fits, expected in (
        ("decimal", columns.decimal, columns.decimal in (".", ","), "'.' or ','"),
        ("gap", columns.gap, columns.gap > 1, "more than 1"),
        ("minimum_samples", columns.minimum_samples, columns.minimum_samples >= 3, "at least 3"),
    ):
        if not fits:
            raise LogError(f"{setting} is {said!r}, expected {expected}")


def _refuse_shared(
    columns: LogFormat, states: Sequence[Channel], actions: Sequence[Channel]
) -> None:
    """Refuse a column that is read for a state and for another channel; actions may share one."""
    read: dict[str | int, str] = {}
    for given, channels in ((columns.actions, actions), (columns.states, states)):
        for channel in channels:
            column = named_column(given.get(channel.name, ""), channel.name)
            first = read.setdefault(column.column, channel.name)
            if first != channel.name and given is columns.states:
                raise LogError(
                    f"column {column.column!r} is read for {first!r} and for {channel.name!r}, "
                    f"expected one of its own: name that of {channel.name!r} under states:"
                )


def named_column(given: str | int | Column, name: str) -> Column:
    """The long form of what a config says; an empty column is named like its channel."""
    column = given if isinstance(given, Column) else Column(given)
    return dataclasses.replace(column, column=name) if column.column == "" else column
