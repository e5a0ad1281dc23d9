"""HDF5 files: datasets side by side, or episodes in groups as Minari and robomimic write them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from residual.logs.table import LogError, Table, shortened
from simgap_files.arrays import FileError
from simgap_files.npz import check_unpacked

EPISODE = "episode"

_NUMBERED = re.compile(r"^(?P<before>.*?)(?P<kind>[A-Za-z]+)_(?P<number>\d+)/(?P<rest>.+)$")

Arrays = dict[str, NDArray[Any]]


def read_hdf5(path: Path) -> Table:
    """An HDF5 file as a table; needs the extra ``logs``.

    Datasets of shape (n,) are columns, those of shape (n, k) columns ``name.0``, ``name.1``, ...
    Groups that are numbered (``episode_0``, ``data/demo_3``) are trajectories, told apart by a
    column ``episode``; names of columns are those inside the group, with dots
    (``observations.qpos.0``). A dataset that is one shorter than the others, such as the actions of
    a Minari episode, lacks its last value.

    Raises:
        LogError: The file is broken or holds no table, or h5py is missing.
    """
    try:
        import h5py
    except ImportError:
        raise LogError(
            "HDF5 needs the package h5py: `pip install h5py` (extra `logs`)", path
        ) from None
    episodes: dict[tuple[str, int], Arrays] = {}
    single: Arrays = {}

    def visit(name: str, item: Any) -> None:
        if not isinstance(item, h5py.Dataset) or item.ndim not in (1, 2):
            return
        if item.dtype.kind not in "biuf":
            return
        if item.is_virtual or item.external:
            raise LogError(f"{name} lies in another file; write its numbers into this one", path)
        check_unpacked(
            f"dataset {name}", item.size * item.dtype.itemsize, item.id.get_storage_size()
        )
        found = _NUMBERED.match(name)
        if found is None:
            single[name.replace("/", ".")] = item[()]
        else:
            key = (found["before"] + found["kind"], int(found["number"]))
            episodes.setdefault(key, {})[found["rest"].replace("/", ".")] = item[()]

    try:
        with h5py.File(path, "r") as file:
            file.visititems(visit)
    except LogError:
        raise
    except FileError as error:
        raise LogError(str(error), path) from None
    # Broken bytes make the library raise nearly anything.
    except Exception as error:
        raise LogError(
            f"cannot be read as HDF5 ({shortened(str(error))}); write the file again", path
        ) from None
    if not episodes:
        return _joined(path, [single], None)
    order = sorted(episodes)
    return _joined(path, [episodes[key] for key in order], [number for _, number in order])


def _joined(path: Path, parts: list[Arrays], numbers: list[int] | None) -> Table:
    """Episodes one below the other."""
    tables = []
    for number, arrays in zip(numbers or [0], parts, strict=True):
        columns = _columns(arrays)
        if not columns:
            raise LogError("holds no array of numbers, expected one row per sample", path)
        length = max(len(values) for values in columns.values())
        short = {name: v for name, v in columns.items() if not length - 1 <= len(v) <= length}
        if short:
            found = ", ".join(f"{name}: {len(values)}" for name, values in columns.items())
            raise LogError(
                f"arrays of different length ({shortened(found, 160)}), expected one length, "
                "or one less for actions",
                path,
            )
        full = {
            name: np.concatenate([values.astype(float), np.full(length - len(values), np.nan)])
            for name, values in columns.items()
        }
        if numbers is not None:
            full[EPISODE] = np.full(length, float(number))
        tables.append(full)
    names = tuple(dict.fromkeys(name for table in tables for name in table))
    joined: dict[str | int, Any] = {
        name: np.concatenate(
            [t.get(name, np.full(len(next(iter(t.values()))), np.nan)) for t in tables]
        )
        for name in names
    }
    rows = np.arange(1, len(joined[names[0]]) + 1)
    return Table(path, joined, names, rows)


def _columns(arrays: Arrays) -> Arrays:
    found: Arrays = {}
    for name, array in arrays.items():
        if array.ndim == 1:
            found[name] = array
        else:
            found |= {f"{name}.{k}": array[:, k] for k in range(array.shape[1])}
    return found
