"""Signals that were recorded on clocks of their own, put on the clock of the measurements."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from residual.logs.checks import Finding
from residual.logs.layout import Column, LogFormat, named_column
from residual.logs.table import LogError, Table
from sims.simulator import Channel

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class Signal:
    """One number of one topic over time.

    Attributes:
        times: When it was measured or sent, in s, shape (n,), not decreasing.
        values: shape (n,).
        clock: The topic: signals of one clock have the same times.
    """

    times: Array
    values: Array
    clock: str


def on_one_clock(
    path: Path,
    signals: Mapping[str, Signal],
    columns: LogFormat,
    states: Sequence[Channel],
    actions: Sequence[Channel],
    findings: list[Finding],
) -> Table:
    """The table of a recording: rows are the samples of the measured states.

    States of several topics are put together by their time stamps; between them a value is
    missing. A command on another clock than the measurements becomes its mean over each sample
    interval, held from message to message as a robot holds it, so that it is neither late nor
    early. Messages before the first command are left out.

    Args:
        path: The file, for messages.
        signals: All that was recorded, by field.
        columns: Which field is which channel.
        states, actions: The simulator's channels.
        findings: What was aligned is added here.

    Raises:
        LogError: No field is a measured state, or a command never came.
    """
    seen, commands = (_fields(signals, given, channels) for given, channels in (
        (columns.states, states), (columns.actions, actions),
    ))  # fmt: skip
    present = [signals[name] for name in seen if name in signals]
    if not present:
        return Table(
            path, {name: s.values for name, s in signals.items()}, tuple(signals), _rows(0)
        )
    times = np.unique(np.concatenate([signal.times for signal in present]))
    table: dict[str | int, Array] = {"time": times}
    for name in seen:
        if name in signals:
            table[name] = _at(signals[name], times)
    clocks = {signal.clock for signal in present}
    for name in commands:
        if name not in signals or name in table:
            continue
        signal = signals[name]
        if signal.clock in clocks or np.array_equal(signal.times, times):
            table[name] = _at(signal, times)
            continue
        table[name] = _means(signal, times)
        if not np.isfinite(table[name]).any():
            raise LogError(
                f"no message of {signal.clock!r} lies within the measurements "
                f"({times[0]:.3f} to {times[-1]:.3f} s): are the clocks the same?", path,
            )  # fmt: skip
        says = (
            f"{name} was sent on another clock than the measurements and was averaged over "
            "every sample interval."
        )
        findings.append(Finding("aligned", path.name, says))
    started = np.all([np.isfinite(table[n]) for n in commands if n in table] or [times == times], 0)
    first = int(np.argmax(started))
    rest: dict[str | int, Array] = {
        name: signal.values for name, signal in signals.items() if name not in table
    }
    cut = {name: values[first:] for name, values in table.items()}
    names = (*cut, *rest)
    return Table(path, cut | rest, names, _rows(len(times))[first:])


def _rows(count: int) -> NDArray[np.int64]:
    return np.arange(1, count + 1)


def _fields(
    signals: Mapping[str, Signal],
    given: Mapping[str, str | int | Column],
    channels: Sequence[Channel],
) -> list[str]:
    if given:
        named = [named_column(column, name) for name, column in given.items()]
        return [str(column.column) for column in named if column.value is None]
    return [channel.name for channel in channels if channel.name in signals]


def _at(signal: Signal, times: Array) -> Array:
    """Values at their own times, missing at all others."""
    values = np.full(len(times), np.nan)
    values[np.searchsorted(times, signal.times)] = signal.values
    return values


def _means(signal: Signal, times: Array) -> Array:
    """Means over [t_k, t_k+1) of a signal held between its messages; NaN before the first."""
    known = np.isfinite(signal.values)
    at, values = signal.times[known], signal.values[known]
    found = np.full(len(times), np.nan)
    if not len(at):
        return found
    ends = np.append(at[1:], np.inf)
    inside = np.cumsum(np.concatenate([[0.0], values[:-1] * np.diff(at)]))

    def integral(t: Array) -> Array:
        k = np.clip(np.searchsorted(at, t, side="right") - 1, 0, len(at) - 1)
        assert (t <= ends[k]).all()
        return np.asarray(inside[k] + values[k] * (t - at[k]))

    ready = times[:-1] >= at[0]
    mean = np.diff(integral(times)) / np.diff(times)
    # A command that does not change within the interval keeps its bits.
    before = np.searchsorted(at, times[:-1], side="right") - 1
    within = np.searchsorted(at, times[1:], side="left") - 1
    held = values[np.clip(before, 0, None)]
    found[:-1] = np.where(ready, np.where(before == within, held, mean), np.nan)
    if times[-1] >= at[0]:
        found[-1] = values[np.searchsorted(at, times[-1], side="right") - 1]
    return found
