"""Arrays in files: the same content gives the same bytes, and nothing in them is executed."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from simgap_files import atomic_write_bytes

_KEY = "simgap"


def write_arrays(
    path: str | Path, form: str, arrays: Mapping[str, NDArray[Any]], metadata: Mapping[str, Any]
) -> None:
    """Write a safetensors file, whole or not at all.

    Args:
        path: The file.
        form: What kind of file it is, for ``read_arrays``.
        arrays: By name.
        metadata: Values that JSON knows, by name.
    """
    # All metadata under one key: safetensors writes several in any order.
    text = json.dumps({"format": form, **metadata}, sort_keys=True)
    contiguous = {name: np.array(value, order="C") for name, value in arrays.items()}
    atomic_write_bytes(path, save(contiguous, {_KEY: text}))


def read_arrays(path: str | Path, form: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Read a safetensors file: arrays by name, and the metadata, each value JSON.

    Args:
        path: The file.
        form: What its metadata has to say under ``format``.

    Raises:
        FileNotFoundError: There is no such file.
        ValueError: It is not a safetensors file, its metadata is not JSON, or it holds something
            else.
    """
    if not Path(path).is_file():
        raise FileNotFoundError(f"{path} is not a file")
    try:
        with safe_open(path, "np") as file:
            arrays = {name: file.get_tensor(name) for name in list(file.keys())}
            texts = file.metadata() or {}
        metadata = {key: json.loads(text) for key, text in texts.items()}
        # Before version 0.2 every value had a key of its own.
        metadata = metadata.get(_KEY, metadata)
    except (SafetensorError, json.JSONDecodeError) as error:
        raise ValueError(f"{path} is not a safetensors file of this toolkit: {error}") from error
    if metadata.get("format") != form:
        raise ValueError(
            f"{path} has format {metadata.get('format')!r}, expected {form!r}: agents are read by "
            "DDPG.load, policies by MlpPolicy.load"
        )
    return arrays, metadata
