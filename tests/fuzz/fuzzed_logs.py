"""Damaged logs of every kind: refused, repaired with a finding, or read as they are."""

from __future__ import annotations

import csv
import functools
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
from damage import OTHER, REFUSED, SAME, TOLD, Defect, damaged
from sound_logs import BINARY, LAYOUTS, SIMULATOR, TABLE, TEXT, folder_of, sound

from residual.gap.data.examine import findings
from residual.logs import Column, LogError, LogFormat, read_logs

KINDS = (*TEXT, *BINARY)
# Formats that carry checksums of all their content: damage cannot pass for other numbers.
CHECKED = ("npz", "packed", "mcap")


def attempt(kind: str, rng: np.random.Generator, folder: Path) -> str:
    """Damage one log and read it; how it ended.

    Raises:
        Defect: In a way that is not promised.
    """
    source, file = sound(kind, folder)
    place = folder / f"damaged-{source.name}"
    layout = LAYOUTS.get(kind, LogFormat())
    if kind == "frame":
        return _ended(kind, _odd_frame(rng), None, layout)
    if file != source:
        shutil.copytree(source, place, dirs_exist_ok=True)
        target = place / file.relative_to(source)
    else:
        target = place
    if kind in TEXT and rng.random() < 0.75:
        content = _edited(file.read_text(encoding="utf-8"), TEXT[kind], rng)
    else:
        content = damaged(file.read_bytes(), rng)
    target.write_bytes(content)
    if rng.random() < 0.1:
        layout = _odd_layout(layout, rng)
    return _ended(kind, place, target, layout)


def _ended(kind: str, log: object, target: Path | None, layout: LogFormat) -> str:
    states, actions = SIMULATOR.physical_channels, SIMULATOR.action_channels
    try:
        data = read_logs([log], states, actions, layout)
    except LogError as error:
        if "\n" in str(error) or len(str(error)) > 800:
            raise Defect(f"not one line that can be read: {error}") from None
        # A layout that no file could satisfy is refused before a file is opened.
        if target and layout == LAYOUTS.get(kind, LogFormat()) and str(log) not in str(error):
            raise Defect(f"does not name {log}: {error}") from None
        return REFUSED
    for run in data.trajectories:
        if not (np.isfinite(run.times).all() and (np.diff(run.times) > 0).all()):
            raise Defect(f"times {run.times}")
        if np.isinf(run.states).any() or not np.isfinite(run.actions).all():
            raise Defect("infinite states, or actions that are no numbers")
    found = [*data.findings, *findings(SIMULATOR, data.trajectories)]
    if _equal(data.trajectories, whole(kind)):
        return SAME
    if {one.kind for one in found if one.kind != "sampling"} - _usual(kind):
        return TOLD
    usual = layout == LAYOUTS.get(kind, LogFormat())
    if kind in CHECKED and usual:
        raise Defect("other numbers without a finding")
    if kind in TEXT and usual:
        assert target is not None
        if not _says(data.trajectories, target, *TEXT[kind]):
            raise Defect("numbers that are not those of the file, without a finding")
    return OTHER


@functools.cache
def whole(kind: str) -> tuple:
    log = dict(TABLE) if kind == "frame" else folder_of(kind)
    layout = LAYOUTS.get(kind, LogFormat())
    return _read(log, layout).trajectories


@functools.cache
def _usual(kind: str) -> set[str]:
    log = dict(TABLE) if kind == "frame" else folder_of(kind)
    data = _read(log, LAYOUTS.get(kind, LogFormat()))
    found = [*data.findings, *findings(SIMULATOR, data.trajectories)]
    return {one.kind for one in found}


def _read(log, layout):
    return read_logs([log], SIMULATOR.physical_channels, SIMULATOR.action_channels, layout)


_FIELDS = (
    "", "nan", "inf", "-inf", "1e400", "-", "abc", "1,5", "1_0", "0x10", "\u0661", "9" * 400, '"',
    "\0", "1e300", "  ", "1e16", "None", "1.2.3", "+-1", "1;2", "0", "-0", "1e-320", "\ud800"[:0],
    "12345", "-7.5",
)  # fmt: skip


def _edited(text: str, how: tuple[str, str], rng: np.random.Generator) -> bytes:
    """The accidents of a table: lost, repeated or swapped rows, odd fields, other headers."""
    between, _ = how
    rows = [line.split(between) for line in text.splitlines()]
    encoding, end = "utf-8", "\n"
    for _ in range(rng.integers(1, 4)):
        i, j = (int(k) for k in rng.integers(0, len(rows), 2))
        c, d = (int(k) for k in rng.integers(0, 4, 2))
        width = len(rows[i])
        match rng.integers(19):
            case 0:
                del rows[i]
            case 1:
                rows.insert(i, list(rows[j]))
            case 2:
                rows[i], rows[j] = rows[j], rows[i]
            case 3 | 4 | 5 if width:
                rows[i][c % width] = str(rng.choice(_FIELDS))
            case 6 if width:
                del rows[i][c % width]
            case 7:
                rows[i].insert(c, "1.0")
            case 8:
                rows[0] = [rows[0][k % len(rows[0])] for k in rng.permutation(4)]
            case 9:
                rows[0][c % len(rows[0])] = str(rng.choice(["", "Time", "angle", "rate", "1", "x"]))
            case 10:
                del rows[i:]
            case 11:
                rows = [[*row, row[d % len(row)] if row else ""] for row in rows]
            case 12:
                rows = [row[:c] + row[c + 1 :] for row in rows]
            case 13:
                rows = [rows[0], *rows[:0:-1]]
            case 14:
                factor = float(rng.choice([0.0, -1.0, 57.3, 1000.0, 1e9, np.nan]))
                for row in rows[1:]:
                    _scaled(row, c, factor)
            case 15:
                rows.insert(i, ["# a note"])
            case 16:
                encoding = str(rng.choice(["utf-16", "utf-8-sig", "latin-1"]))
            case 17:
                end = str(rng.choice(["\r\n", "\r", "\n\n", "\x0b", "\u2028"]))
            case 18:
                rows[i:j] = []
        rows = rows or [[""]]
        rows[0] = rows[0] or [""]
    text = end.join(between.join(row) for row in rows) + end
    if rng.random() < 0.1:
        text = text[: int(rng.integers(len(text) + 1))]
    return text.encode(encoding, errors="replace")


def _scaled(row: list[str], column: int, factor: float) -> None:
    try:
        row[column] = f"{float(row[column]) * factor:.6g}"
    except (ValueError, IndexError):
        return


def _odd_layout(layout: LogFormat, rng: np.random.Generator) -> LogFormat:
    number = float(rng.choice([np.nan, np.inf, -np.inf, 0.0, -1.0, 1e300, 1e-300, 0.5]))
    column = Column("angle", scale=number, offset=float(rng.choice([0.0, np.nan, np.inf, 1e308])))
    odd = [
        {"period": number}, {"start": number}, {"stop": number}, {"gap": number},
        {"minimum_samples": int(rng.integers(-1, 10**6))}, {"header": False},
        {"delimiter": str(rng.choice(["", "ab", '"', "\n", "comma", "tab", "x"]))},
        {"comment": str(rng.choice(["", "t", "0", "\0"]))}, {"decimal": ","},
        {"states": {"angle": column}}, {"actions": {"voltage": Column(value=number)}},
        {"trajectory": ["rate"]}, {"trajectory": ["none"]}, {"only": {"time": ["0"]}},
        {"split_at_time_resets": True}, {"time": Column("time", unit="ms")}, {"time": 1},
        {"states": {"angle": 10**9}}, {"states": {"angle": -1}},
        {"states": {"angle": Column("angle", unit=str(rng.choice(["deg", "kg", "", "\0"])))}},
    ]  # fmt: skip
    given = {name: getattr(layout, name) for name in layout.__dataclass_fields__}
    return LogFormat(**{**given, **odd[rng.integers(len(odd))]})


def _odd_frame(rng: np.random.Generator) -> object:
    table: dict = {name: values.copy() for name, values in TABLE.items()}
    name = str(rng.choice(list(table)))
    row = int(rng.integers(len(TABLE["time"])))
    values: object = None
    match rng.integers(14):
        case 0:
            table[name][row] = rng.choice([np.nan, np.inf, 1e300, -1e16])
        case 1:
            values = table[name].astype(complex)
        case 2:
            values = table[name].astype(str)
        case 3:
            values = table[name].astype(object)
            values[row] = rng.choice([None, "x", 3, True])  # type: ignore[index]
        case 4:
            values = table[name][: row + 1]
        case 5:
            values = table[name][None, None]
        case 6:
            values = np.float64(1.0)
        case 7:
            values = pd.array(table[name], dtype="Float64")
        case 8:
            values = pd.to_datetime(table[name], unit="s").to_numpy()
        case 9:
            values = table[name] > 0
        case 10:
            values = pd.Categorical(table[name].astype(str))
        case 11:
            return rng.choice([None, 3, "nowhere.csv", ""], 1)[0]
        case 12:
            del table[name]
        case 13:
            return table.values()
    if values is not None:
        table[name] = values
    if rng.random() < 0.5:
        try:
            return pd.DataFrame(table)
        except ValueError:
            return table
    return table


def _equal(first: tuple, second: tuple) -> bool:
    return len(first) == len(second) and all(
        a.times.shape == b.times.shape
        and np.allclose(a.times, b.times, rtol=0, atol=1e-9)
        and np.array_equal(a.states, b.states, equal_nan=True)
        and np.array_equal(a.actions, b.actions)
        for a, b in zip(first, second, strict=True)
    )


def _says(trajectories: tuple, path: Path, between: str, decimal: str) -> bool:
    """Whether a plain reading of the text gives these very numbers, all of its rows."""
    text = path.read_text(encoding="utf-8-sig")
    rows = [
        [field.strip() for field in row]
        for row in csv.reader(text.replace("\x0b", " ").splitlines(), delimiter=between)
        if row and any(row) and not row[0].lstrip().startswith("#")
    ]
    names, *lines = rows
    names = [name for name in names]
    lines = [line for line in lines if len(line) >= len(names)]

    def column(name: str) -> np.ndarray:
        at = names.index(name)
        return np.array(
            [float(x[at].replace(decimal, ".")) if x[at] not in ("", "-", "None") else np.nan
             for x in lines]
        )  # fmt: skip

    times = np.concatenate([run.times for run in trajectories])
    if len(times) != len(lines) or not np.allclose(times, column("time")):
        return False
    seen = np.concatenate([run.states for run in trajectories])
    for k, name in enumerate(("angle", "rate")):
        if name not in names:
            continue
        error = seen[:, k] - column(name)
        if k == 0:
            error = np.angle(np.exp(1j * error))
        if not (np.abs(error[np.isfinite(error)]) < 1e-9).all():
            return False
    acted = np.concatenate([run.actions[:, 0] for run in trajectories])
    return len(trajectories) > 1 or np.allclose(acted, column("voltage")[:-1])
