"""One file as named columns that remember which row of the file each value is from."""

from __future__ import annotations

import contextlib
import dataclasses
import difflib
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from residual.logs.dates import DATED, looks_dated, seconds_of

Array = NDArray[np.float64]

_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
_MISSING = {"", "nan", "na", "n/a", "null", "none", "-"}
#: Switches, as programs write them.
_TRUTH = {"true": 1.0, "false": 0.0, "on": 1.0, "off": 0.0}

#: A number with its unit behind it.
_WITH_UNIT = re.compile(r"[-+]?[\d.,]*\d(?:[eE][-+]?\d+)? ?([^\W\d_]{1,4}|[%°µ]\w{0,3})")


class LogError(ValueError):
    """A log cannot be used; the one-line message names file, row, column and the fix."""

    def __init__(
        self,
        says: str,
        path: str | Path = "",
        row: int | None = None,
        column: str | int | None = None,
    ) -> None:
        place = [str(path)] if str(path) else []
        if row is not None:
            place.append(f"row {row}")
        if column is not None:
            place.append(f"column {column!r}")
        message = f"{', '.join(place)}: {says}" if place else says
        super().__init__("".join(c if c.isprintable() else " " for c in message))


@dataclasses.dataclass(frozen=True)
class Table:
    """The columns of one file.

    Attributes:
        path: The file.
        columns: Values by name: numbers as an array, text as a list of strings. Columns of a
            file without header are named by their position, ``1`` being the first.
        names: Column names in the order of the file; those that occur twice also twice.
        rows: Row of the file that each value stands in, as an editor counts: from 1.
        cut_off: True if the file ends in the middle of a row, which was left out.
        headers: Rows that repeat the header, which were left out.
    """

    path: Path
    columns: Mapping[str | int, Sequence[str] | NDArray[Any]]
    names: tuple[str | int, ...]
    rows: NDArray[np.int64]
    cut_off: bool = False
    headers: int = 0

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def listed(self) -> str:
        """The names of the columns, for a message."""
        listed = ", ".join(shortened(str(name)) for name in self.names[:12])
        return listed + (f" and {len(self.names) - 12} more" if len(self.names) > 12 else "")

    def values(self, column: str | int, channel: str = "") -> Sequence[str] | NDArray[Any]:
        """One column as it stands in the file.

        Args:
            column: Name, or position from 1.
            channel: What it was said to hold.

        Raises:
            LogError: It is not there, or there twice.
        """
        if isinstance(column, int) and 1 <= column <= len(self.names):
            column = self.names[column - 1]
        if column not in self.columns:
            near = difflib.get_close_matches(str(column), [str(n) for n in self.names], 1, 0.5)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            wanted = f"no column {column!r}" + (f" for {channel!r}" if channel else "")
            raise LogError(f"{wanted}, the file has {self.listed}{hint}", self.path)
        if self.names.count(column) > 1:
            raise LogError(
                f"{self.names.count(column)} columns have this name, expected one: "
                "rename them, or give the position of the right one (1 is the first)",
                self.path,
                column=column,
            )
        return self.columns[column]

    def numbers(self, column: str | int, decimal: str = ".", channel: str = "") -> Array:
        """One column as numbers; a missing value is NaN.

        Args:
            column: Name, or position from 1.
            decimal: The decimal sign, if the file is text.
            channel: What it was said to hold.

        Raises:
            LogError: The column is not there, holds text or something infinite.
        """
        values = self.values(column, channel)
        if isinstance(values, np.ndarray):
            numbers = self._from_array(values, column)
        else:
            numbers = self._from_text(values, column, decimal)
        infinite = np.flatnonzero(np.isinf(numbers))
        if infinite.size:
            raise LogError(
                "found an infinite value, expected a number; delete the row or leave the value "
                "empty",
                self.path,
                int(self.rows[infinite[0]]),
                column,
            )
        return numbers

    def _from_array(self, values: NDArray[Any], column: str | int) -> Array:
        if values.dtype.kind == "M":
            seconds = values.astype("datetime64[ns]").astype(np.int64) * 1e-9
            return np.where(np.isnat(values), np.nan, seconds)
        if values.dtype.kind == "m":
            seconds = values.astype("timedelta64[ns]").astype(np.int64) * 1e-9
            return np.where(np.isnat(values), np.nan, seconds)
        if values.dtype.kind in "biuf":
            return values.astype(float)
        raise LogError(
            f"holds {values.dtype.name} values, expected numbers", self.path, column=column
        )

    def _from_text(self, texts: Sequence[str], column: str | int, decimal: str) -> Array:
        # The common case, without a missing value, is ten times faster in one go.
        with contextlib.suppress(ValueError):
            if decimal == "." and not any("_" in text for text in texts):
                return np.array(texts, dtype=float)
        dated = seconds_of(texts)
        if dated is not None:
            return dated
        if decimal == "." and _commas(texts):
            decimal = ","
        numbers = np.empty(len(texts))
        for index, text in enumerate(texts):
            try:
                # Python's own extras, such as 1_000, are no numbers in a log.
                if "_" in text:
                    raise ValueError
                numbers[index] = float(text if decimal == "." else text.replace(decimal, "."))
            except ValueError:
                if text.lower() in _TRUTH:
                    numbers[index] = _TRUTH[text.lower()]
                elif text.lower() in _MISSING:
                    numbers[index] = np.nan
                else:
                    fix = "correct the value or leave it empty"
                    if "," in text and decimal == ".":
                        fix = _of_commas(text)
                    if with_unit := _WITH_UNIT.fullmatch(text):
                        unit = with_unit[1]
                        fix = f"leave {unit} out of the cells, and say `unit: {unit}` of the column"
                    elif looks_dated(text):
                        fix = f"write times in seconds, or {DATED}"
                    elif index and index == len(texts) - 1:
                        fix = f"{fix}; if this row is no sample, delete it"
                    raise LogError(
                        f"found {shortened(text)}, expected a number; {fix}",
                        self.path,
                        int(self.rows[index]),
                        column,
                    ) from None
        return numbers


def _commas(texts: Sequence[str]) -> bool:
    """Whether numbers have decimal commas for sure: not one point, and no thousands."""
    commas = [text for text in texts if "," in text]
    return (
        bool(commas)
        and not any("." in text for text in texts)
        and all(_COMMA.fullmatch(text) for text in commas)
        and any(not _THOUSANDS.fullmatch(text) for text in commas)
    )


def _of_commas(text: str) -> str:
    """What to do about the commas of a number."""
    if "." in text or text.count(",") > 1:
        return "leave out the commas between thousands"
    if _THOUSANDS.fullmatch(text):
        return "leave out the commas if they part thousands, set decimal: ',' if they are decimal"
    return "set decimal: ','"


def shortened(text: str, length: int = 40) -> str:
    """Text in quotes, cut to a length that fits into a message."""
    return repr(text if len(text) <= length else f"{text[: length - 3]}...")
