"""Reading and writing arrays safely: whole files only, and nothing in them is executed."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from safetensors import SafetensorError, safe_open


def write_whole(path: str | Path, content: bytes) -> None:
    """Write a file so that a reader, or a kill at any moment, never sees half of it."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        draft.write_bytes(content)
        draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)


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
            arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
            metadata = {key: json.loads(text) for key, text in (file.metadata() or {}).items()}
    except (SafetensorError, json.JSONDecodeError) as error:
        raise ValueError(f"{path} is not a safetensors file of this toolkit: {error}") from error
    if metadata.get("format") != form:
        raise ValueError(
            f"{path} has format {metadata.get('format')!r}, expected {form!r}: agents are read by "
            "DDPG.load, policies by MlpPolicy.load"
        )
    return arrays, metadata
