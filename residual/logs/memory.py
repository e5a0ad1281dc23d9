"""Data frames and dictionaries of arrays as tables."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from residual.logs.table import LogError, Table


def table_of(data: Any, number: int) -> Table:
    """A data frame or a dictionary as a table.

    Arrays of shape (n,) are columns, those of shape (n, k) columns ``name.0``, ``name.1``, ...; the
    index of a data frame is the time if it is named so or holds dates.

    Args:
        data: A ``pandas.DataFrame``, or arrays by name.
        number: Its place among the logs, for messages.

    Raises:
        LogError: It is neither, or lengths differ.
    """
    import pandas as pd

    path = Path(f"log {number} in memory")
    columns: dict[str | int, Any] = {}
    if isinstance(data, pd.DataFrame):
        if "time" not in data.columns and (
            data.index.name == "time"
            or isinstance(data.index, pd.DatetimeIndex | pd.TimedeltaIndex)
        ):
            columns["time"] = data.index.to_numpy()
        columns |= {str(name): data[name].to_numpy() for name in data.columns}
    elif isinstance(data, Mapping):
        for name, values in data.items():
            array = np.asarray(values)
            if array.ndim == 1:
                columns[str(name)] = array
            elif array.ndim == 2:
                columns |= {f"{name}.{k}": array[:, k] for k in range(array.shape[1])}
            else:
                raise LogError(f"{name!r} has shape {array.shape}, expected (n,) or (n, k)", path)
    else:
        raise LogError(
            f"{type(data).__name__} is no log, expected a file, a DataFrame or arrays by name", path
        )
    lengths = {name: len(values) for name, values in columns.items()}
    if len(set(lengths.values())) != 1 or not next(iter(lengths.values())):
        raise LogError(f"columns of length {lengths}, expected one length above zero", path)
    return Table(path, columns, tuple(columns), np.arange(1, next(iter(lengths.values())) + 1))
