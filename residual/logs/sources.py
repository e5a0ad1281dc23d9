"""Whatever holds a log, as a table: by the kind of the file, folder or object."""

from __future__ import annotations

import contextlib
import dataclasses
import glob
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from residual.logs import hdf5, lerobot
from residual.logs.checks import Finding
from residual.logs.clocks import Signal, on_one_clock
from residual.logs.files import read_table
from residual.logs.headers import TIME, time_column
from residual.logs.layout import Column, LogFormat
from residual.logs.mcap_file import read_mcap
from residual.logs.memory import table_of
from residual.logs.table import LogError, Table
from residual.logs.units import find_unit
from sims.simulator import Channel

HDF5, MCAP = (".h5", ".hdf5"), (".mcap",)

#: Where Minari keeps the episodes of a data set.
MINARI = Path("data", "main_data.hdf5")
#: How much a period may differ from the steps of the times in a file, as a share.
SAME_STEP = 0.05


def matching(paths: Sequence[Any]) -> list[Any]:
    """The logs, with the files that match in place of a pattern such as ``logs/*.csv``: not every
    shell has expanded it.

    Raises:
        LogError: No file matches.
    """
    found: list[Any] = []
    for path in paths:
        named = isinstance(path, str | Path) and not Path(path).exists()
        if not named or not set("*?[").intersection(str(path)):
            found.append(path)
            continue
        files = sorted(glob.glob(str(path), recursive=True))
        if not files:
            raise LogError("no file matches, expected logs; mend the pattern", path)
        found += files
    return found


def open_log(
    source: Any,
    number: int,
    columns: LogFormat,
    states: Sequence[Channel],
    actions: Sequence[Channel],
    findings: list[Finding],
) -> tuple[Table, LogFormat]:
    """A log as a table, and its layout with what its kind implies.

    Args:
        source: A file (text, Parquet, NPZ, MCAP, HDF5), the folder of a LeRobot or Minari data
            set, a data frame, or arrays by name.
        number: Its place among the logs.
        columns: The layout that the user gave.
        states, actions: The simulator's channels.
        findings: What was aligned in time is added here.

    Raises:
        LogError: It cannot be read.
    """
    if not isinstance(source, str | Path):
        return _with_time(table_of(source, number), columns)
    path = Path(source)
    if path.is_dir():
        if lerobot.is_lerobot(path):
            table, columns = lerobot.read_lerobot(path), _episodes(columns, lerobot.EPISODE)
            if columns.time == "time" and lerobot.TIME in table.columns:
                columns = dataclasses.replace(columns, time=lerobot.TIME)
            return _with_time(table, columns)
        if (path / MINARI).is_file():
            path = path / MINARI
        else:
            raise LogError(
                f"this is not a file, and no folder with {lerobot.INFO} (LeRobot) or {MINARI} "
                "(Minari); give the log files themselves",
                path,
            )
    suffix = path.suffix.lower()
    if suffix in (*HDF5, *MCAP) and not path.is_file():
        raise LogError("there is no such file, expected a log; mend the path", path)
    if suffix in MCAP:
        signals = read_mcap(path)
        return on_one_clock(path, signals, columns, states, actions, findings), columns
    if suffix in HDF5:
        table = hdf5.read_hdf5(path)
        if hdf5.EPISODE in table.columns:
            columns = _episodes(columns, hdf5.EPISODE)
        return _with_time(table, columns)
    text = (columns.delimiter, columns.header, columns.comment, columns.skip)
    return _with_time(read_table(path, *text), columns)


def signals_of(source: str | Path) -> tuple[dict[str, Signal], dict[str, str]]:
    """Every field of a file with its times, for a look at what there is; and which hold no numbers.

    Fields of a table without a column of times (``time``, ``Time [ms]``) have the numbers of its
    rows for times.

    Returns:
        Signals by name, and for all other fields what was found in place of a number.

    Raises:
        LogError: It cannot be read.
    """
    path = Path(source)
    if path.suffix.lower() in MCAP:
        return read_mcap(path), {}
    table, _ = open_log(path, 1, LogFormat(), (), (), [])
    times = np.arange(len(table), dtype=float)
    with contextlib.suppress(LogError):
        clock = Column(lerobot.TIME)
        if lerobot.TIME not in table.columns:
            clock = time_column(table, TIME.name, [])
        times = find_unit(clock.unit, TIME.unit).factor * table.numbers(clock.column)
    found, others = {}, {}
    for name in table.names:
        try:
            found[str(name)] = Signal(times, table.numbers(name), "")
        except LogError as error:
            others[str(name)] = str(error)
    return found, others


def _episodes(columns: LogFormat, column: str) -> LogFormat:
    return columns if columns.trajectory else dataclasses.replace(columns, trajectory=[column])


def _with_time(table: Table, columns: LogFormat) -> tuple[Table, LogFormat]:
    """A table without times gets them from the layout's period, from zero in every trajectory.

    Raises:
        LogError: It has times, and they say otherwise.
    """
    if columns.period is None:
        return table, columns
    step = _own_step(table, columns)
    if step is not None and abs(step - columns.period) > SAME_STEP * columns.period:
        raise LogError(
            f"period is {columns.period:g} s, but the times in the file are {step:.4g} s apart: "
            "leave out period, or that column from the file",
            table.path,
        )
    if step is not None:
        return table, columns
    times = np.empty(len(table))
    labels = [np.asarray(table.values(name)) for name in columns.trajectory]
    keys = list(zip(*labels, strict=True)) if labels else [()] * len(table)
    counts: dict[Any, int] = {}
    for row, key in enumerate(keys):
        counts[key] = counts.get(key, -1) + 1
        times[row] = counts[key] * columns.period
    full = dataclasses.replace(
        table, columns={**table.columns, "time": times}, names=(*table.names, "time")
    )
    return full, dataclasses.replace(columns, time="time")


def _own_step(table: Table, columns: LogFormat) -> float | None:
    """Seconds between the times that a table holds, in the median; None if it holds none."""
    with contextlib.suppress(LogError):
        own = time_column(table, columns.time, [])
        times = table.numbers(own.column, columns.decimal)
        step = float(np.nanmedian(np.diff(times)))
        return step * find_unit(own.unit, TIME.unit).factor * own.scale
    return None
