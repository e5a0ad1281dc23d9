"""Arrays in files: the same content gives the same bytes, a checksum tells whether they came back.

A file is one safetensors file whose metadata is one JSON document: what the writer has to say,
the version of this format, and a checksum over all of it and over every array. Nothing in a file
is executed, and reading one claims no more memory than the file is long.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from safetensors import safe_open
from safetensors.numpy import save

from simgap_files.atomic import atomic_write_bytes

VERSION = 2
_KEY = "simgap"


class FileError(ValueError):
    """A file that cannot be used; the message names it, what is wrong and what to do."""


def write_arrays(
    path: str | Path, header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]
) -> None:
    """Write arrays and a header to a safetensors file, whole or not at all.

    Args:
        path: The file.
        header: Values that JSON knows, by name; ``version`` and ``checksum`` are added.
        arrays: By name.
    """
    contiguous = {name: np.array(value, order="C") for name, value in arrays.items()}
    # As it will be read: JSON makes lists of tuples and texts of keys.
    plain = json.loads(json.dumps({**header, "version": VERSION}))
    plain["checksum"] = _checksum(plain, contiguous)
    # All metadata under one key: safetensors writes several in any order.
    metadata = {_KEY: json.dumps(plain, sort_keys=True)}
    atomic_write_bytes(path, save(contiguous, metadata))


def read_arrays(path: str | Path) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Read what ``write_arrays`` wrote: the header, and the arrays by name.

    Files of version 1 had no checksum: of those it is only known that they hold finite numbers.

    Raises:
        FileNotFoundError: There is no such file.
        FileError: It is damaged, not of this project, of a later version, or holds numbers that
            are not finite.
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"there is no file {path}")
    try:
        with safe_open(path, "np") as file:
            texts = file.metadata() or {}
            # Before version 0.2 every value had a key of its own.
            own = _KEY in texts or "format" in texts
            arrays = {name: file.get_tensor(name) for name in list(file.keys())} if own else {}
        header = json.loads(texts[_KEY]) if _KEY in texts else {
            key: json.loads(text) for key, text in texts.items() if own
        }  # fmt: skip
    # Rust's messages come as classes of their own, and unknown types of numbers as others yet.
    except Exception as error:
        raise FileError(
            f"{path} is damaged or no safetensors file ({type(error).__name__}: {error})"
        ) from None
    if not own:
        raise FileError(f"{path} is a safetensors file, but not of this project")
    _check(path, header, arrays)
    return header, arrays


def _check(path: Path, header: Any, arrays: Mapping[str, NDArray[Any]]) -> None:
    if not isinstance(header, dict):
        raise FileError(f"{path} is damaged: its metadata is no JSON object")
    version, checksum = header.get("version", 1), header.pop("checksum", None)
    if type(version) is not int or not 1 <= version <= VERSION:
        raise FileError(
            f"{path} has format version {version!r}, this release reads up to {VERSION}: write it "
            "again with this release"
        )
    if checksum is None and version > 1:
        raise FileError(f"{path} is damaged: its checksum is missing")
    if checksum is not None and checksum != _checksum(header, arrays):
        raise FileError(f"{path} is damaged: its content does not have its checksum")
    for name, array in arrays.items():
        if array.dtype.kind not in "fiub":
            raise FileError(f"{path}: array {name!r} holds {array.dtype}, expected real numbers")
        if not np.isfinite(array).all():
            raise FileError(f"{path} is damaged: array {name!r} holds values that are not finite")


def _checksum(header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> str:
    found = hashlib.sha256(json.dumps(header, sort_keys=True).encode())
    for name in sorted(arrays):
        array = arrays[name]
        found.update(json.dumps([name, array.dtype.str, array.shape]).encode())
        found.update(np.ascontiguousarray(array).data)
    return found.hexdigest()
