"""LeRobot data sets: a folder of Parquet files beside a description of their columns."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from residual.logs.files import check_parquet
from residual.logs.table import LogError, Table, shortened

INFO = Path("meta", "info.json")
EPISODE, TIME = "episode_index", "timestamp"


def is_lerobot(path: Path) -> bool:
    """Whether a folder is such a data set."""
    return (path / INFO).is_file()


def read_lerobot(path: Path) -> Table:
    """All episodes of a data set as one table.

    A feature of several numbers becomes a column for each, by the names that the description gives
    (``observation.state.elbow``) or by number (``action.0``). Pictures are left out.

    Raises:
        LogError: The folder holds no such data set, or a file of it is broken.
    """
    import pyarrow.parquet

    try:
        info = json.loads((path / INFO).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise LogError(f"cannot be read ({shortened(str(error))})", path / INFO) from None
    features = info.get("features", {}) if isinstance(info, dict) else {}
    files = sorted((path / "data").rglob("*.parquet"))
    if not files:
        raise LogError("has no Parquet file under data/", path)
    parts: list[dict[str, Any]] = []
    for file in files:
        try:
            opened = pyarrow.parquet.ParquetFile(file, page_checksum_verification=True)
            check_parquet(opened, file.stat().st_size)
            table = opened.read()
        except Exception as error:  # broken bytes raise nearly anything
            raise LogError(
                f"cannot be read as Parquet ({shortened(str(error))}); write the file again", file
            ) from error
        columns: dict[str, Any] = {}
        for name in table.column_names:
            values = table[name].to_numpy()
            if values.dtype.kind in "biuf":
                columns[name] = values.astype(float)
            elif values.dtype == object and len(values) and np.ndim(values[0]) == 1:
                stacked = np.stack(values)
                if stacked.dtype.kind in "biuf":
                    names = _entries(features.get(name, {}), stacked.shape[1])
                    for k, entry in enumerate(names):
                        columns[f"{name}.{entry}"] = stacked[:, k].astype(float)
        parts.append(columns)
    shared = tuple(name for name in parts[0] if all(name in part for part in parts))
    joined: dict[str | int, Any] = {
        name: np.concatenate([part[name] for part in parts]) for name in shared
    }
    rows = np.arange(1, len(joined[shared[0]]) + 1)
    return Table(path, joined, shared, rows)


def _entries(feature: Any, count: int) -> list[str]:
    """Names of a feature's numbers: a list, or a list inside a dictionary, else numbers."""
    names = feature.get("names") if isinstance(feature, dict) else None
    if isinstance(names, dict):
        names = next((value for value in names.values() if isinstance(value, list)), None)
    if isinstance(names, list) and len(names) == count:
        return [str(name) for name in names]
    return [str(k) for k in range(count)]
