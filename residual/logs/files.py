"""Log files of every kind - text, Parquet, NPZ - as tables."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from residual.logs.table import LogError, Table, shortened
from simgap_files.npz import check_unpacked, read_npz

if TYPE_CHECKING:
    import pyarrow.parquet

TEXT, PARQUET, NPZ = (".csv", ".txt", ".tsv", ".dat", ".log"), (".parquet", ".pq"), (".npz",)

_DELIMITERS = {"comma": ",", "semicolon": ";", "tab": "\t", "blank": " "}


def read_table(
    path: Path, delimiter: str = "auto", header: bool = True, comment: str = "", skip: int = 0
) -> Table:
    """Read a file by its extension: text (CSV and the like), Parquet, or NPZ.

    Args:
        path: The file.
        delimiter: Of text: a character, ``"comma"``, ``"semicolon"``, ``"tab"``, ``"blank"`` (any
            number of blanks), or ``"auto"``.
        header: Whether the first row of text that is no comment names the columns.
        comment: Lines of text that begin with it are left out.
        skip: How many lines at the top of a text to leave out.

    Raises:
        LogError: The file cannot be read, or does not look like a table.
    """
    if not path.exists():
        raise LogError("there is no such file, expected a log; mend the path", path)
    if not path.is_file():
        raise LogError("this is not a file; give the log files themselves", path)
    suffix = path.suffix.lower()
    if suffix not in TEXT + PARQUET + NPZ:
        raise LogError(
            f"unknown kind of file {path.suffix!r}, expected one of "
            f"{', '.join(TEXT + PARQUET + NPZ)}, .mcap, .h5, .hdf5",
            path,
        )
    try:
        data = path.read_bytes()
    except OSError as error:
        raise LogError(f"cannot be read ({error.strerror})", path) from error
    if not data:
        raise LogError("the file is empty, expected a table with one row per sample", path)
    if suffix in TEXT:
        return _read_text(path, data, delimiter, header, comment, skip)
    return _read_arrays(path, data, suffix)


def _read_text(
    path: Path, data: bytes, delimiter: str, header: bool, comment: str, skip: int
) -> Table:
    lines: list[tuple[int, str]] = []
    above = ""
    for number, line in enumerate(_decoded(path, data).splitlines(), start=1):
        if comment and line.lstrip().startswith(comment):
            above = above if lines else line.lstrip().removeprefix(comment)
        elif number > skip and line.strip():
            lines.append((number, line))
    if not lines:
        raise LogError("no row holds data, expected a table with one row per sample", path)
    rows = _split(path, lines, delimiter)
    first, names_row = rows[0]
    names: tuple[str | int, ...] = tuple(range(1, len(names_row) + 1))
    repeated = 0
    if header:
        numbers = all(_is_number(field) for field in names_row)
        if numbers and (commented := _names_in(above, lines[0][1], delimiter, path)):
            # As NumPy's savetxt writes them: names in a comment just above the table.
            rows.insert(0, (first, names_row := commented))
        elif numbers:
            raise LogError(
                f"holds only numbers ({shortened(', '.join(names_row))}), expected the names of "
                "the columns; if the file has none, set header: false and give columns by "
                "position (1 is the first)",
                path,
                first,
            )
        below = [row for row in rows[1:] if row[1] != names_row]
        repeated = len(rows) - 1 - len(below)
        names, rows = tuple(names_row), below
    if not rows:
        raise LogError("only the header is there, expected one row per sample below it", path)
    cut_off = len(rows) > 1 and len(rows[-1][1]) < len(names)
    for number, fields in rows[: len(rows) - cut_off]:
        if len(fields) > len(names) and not any(fields[len(names) :]):
            del fields[len(names) :]
        if len(fields) != len(names):
            raise LogError(
                f"{len(fields)} fields, expected {len(names)} as in row {first}; correct or "
                "delete the row, set delimiter, or set columns.skip to the number of lines that "
                "stand above the table",
                path,
                number,
            )
    rows = rows[: len(rows) - cut_off]
    columns: dict[str | int, list[str]] = {}
    for name, *fields in zip(names, *(fields for _, fields in rows), strict=True):
        columns.setdefault(name, fields)
    return Table(path, columns, names, np.array([number for number, _ in rows]), cut_off, repeated)


def _names_in(comment: str, row: str, delimiter: str, path: Path) -> list[str]:
    """Names of columns in a comment, nothing if it does not name those of a row of numbers."""
    if not comment.strip() or '"' in comment:
        return []
    (_, fields), (_, names) = _split(path, [(1, row), (1, comment.strip())], delimiter)
    named = len(names) == len(fields) and not any(_is_number(n) or not n for n in names)
    return names if named else []


def _decoded(path: Path, data: bytes) -> str:
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise LogError(
            f"byte 0x{data[error.start]:02x} is not UTF-8 text; save the file as UTF-8",
            path,
            data[: error.start].count(b"\n") + 1,
        ) from None
    if "\0" in text:
        raise LogError(
            "holds zero bytes: it is not a text file, or was not written to its end",
            path,
            text[: text.index("\0")].count("\n") + 1,
        )
    # Only what an editor takes for the end of a line may end one here.
    return text.replace("\r\n", "\n").replace("\r", "\n").translate(_ODD_LINE_ENDS)


_ODD_LINE_ENDS = {ord(c): " " for c in "\v\f\x1c\x1d\x1e\x85\u2028\u2029"}


def _split(
    path: Path, lines: Sequence[tuple[int, str]], delimiter: str
) -> list[tuple[int, list[str]]]:
    delimiter = _DELIMITERS.get(delimiter, delimiter)
    if delimiter == "auto":
        # A blank delimits only if nothing else does: names may hold blanks.
        delimiter = max(",;\t", key=lines[0][1].count)
        delimiter = delimiter if delimiter in lines[0][1] else " "
    if len(delimiter) != 1 or delimiter in '"\r\n':
        raise LogError(
            f"delimiter {delimiter!r} is not usable, expected one character or one of auto, "
            f"{', '.join(_DELIMITERS)}"
        )
    if delimiter == " ":
        return [(number, line.split()) for number, line in lines]
    numbers = [number for number, _ in lines]
    reader = csv.reader(
        (line for _, line in lines), delimiter=delimiter, skipinitialspace=True, strict=True
    )
    rows: list[tuple[int, list[str]]] = []
    try:
        for fields in reader:
            if reader.line_num > len(rows) + 1:
                raise csv.Error("a quoted field runs over several rows")
            rows.append((numbers[len(rows)], [field.strip() for field in fields]))
    except (csv.Error, ValueError) as error:
        raise LogError(
            f"cannot be split into fields ({error}); look for a lone quote",
            path,
            numbers[len(rows)],
        ) from None
    return rows


def _read_arrays(path: Path, data: bytes, suffix: str) -> Table:
    # On broken bytes these libraries raise nearly anything, which means the same to the user.
    try:
        arrays = _parquet(data) if suffix in PARQUET else _npz(data)
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        kind = "Parquet" if suffix in PARQUET else "NPZ"
        raise LogError(
            f"cannot be read as {kind} ({shortened(reason)}); write the file again", path
        ) from error
    lengths = {len(array) for _, array in arrays}
    if not arrays or lengths == {0}:
        raise LogError("holds no rows, expected one row per sample", path)
    if len(lengths) > 1:
        found = ", ".join(f"{name}: {len(array)}" for name, array in arrays)
        raise LogError(f"columns of different length ({found}), expected one length", path)
    names = tuple(name for name, _ in arrays)
    return Table(path, dict(arrays), names, np.arange(1, lengths.pop() + 1))


def _parquet(data: bytes) -> list[tuple[str | int, NDArray[Any]]]:
    import pyarrow.parquet

    opened = pyarrow.parquet.ParquetFile(io.BytesIO(data), page_checksum_verification=True)
    check_parquet(opened, len(data))
    table = opened.read()
    return [
        (name, column.to_numpy())
        for name, column in zip(table.column_names, table.columns, strict=True)
    ]


def check_parquet(file: pyarrow.parquet.ParquetFile, size: int) -> None:
    """Refuse a Parquet file of ``size`` bytes that would unpack to far more.

    Raises:
        ValueError: It would.
    """
    about = file.metadata
    parts = [about.row_group(k) for k in range(about.num_row_groups)]
    rows = max(about.num_rows, sum(part.num_rows for part in parts))
    unpacked = sum(part.total_byte_size for part in parts)
    check_unpacked("the file", max(unpacked, 8 * rows * about.num_columns), size)


def _npz(data: bytes) -> list[tuple[str | int, NDArray[Any]]]:
    """Arrays of shape (n,) as columns; those of shape (n, k) as ``name.0``, ``name.1``, ..."""
    arrays: list[tuple[str | int, NDArray[Any]]] = []
    for name, array in read_npz("the file", data).items():
        if array.ndim == 1:
            arrays.append((name, array))
        elif array.ndim == 2:
            arrays += [(f"{name}.{k}", array[:, k]) for k in range(array.shape[1])]
    return arrays


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
