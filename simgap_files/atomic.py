"""Files that appear whole or not at all, so that a killed study never leaves half of one."""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import json
import math
import os
import secrets
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

FORMAT = 2
_PARTIAL = ".partial-"


@contextlib.contextmanager
def atomic_path(path: str | Path) -> Iterator[Path]:
    """A temporary path beside ``path``, moved onto it when the block ends without an error.

    For writers that want a path (``np.savez``, ``figure.savefig``, safetensors). The temporary
    name keeps the suffix, since many writers choose the format, or add a suffix, by it. Missing
    folders are made. Several processes may write the same ``path``: the last one stays.

    Args:
        path: The file to write.

    Yields:
        The path to write to; it does not exist yet.

    Raises:
        OSError: The folder cannot be made or written. ``path`` is then as it was.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.parent / f"{_PARTIAL}{secrets.token_hex(4)}-{path.name}"
    try:
        yield temporary
        # Without it a power cut after the rename may leave the new name on an empty file.
        with open(temporary, "rb+") as file:
            os.fsync(file.fileno())
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def atomic_write_bytes(path: str | Path, data: bytes) -> None:
    """Write ``data`` to ``path``, whole or not at all."""
    with atomic_path(path) as temporary:
        temporary.write_bytes(data)


def atomic_write_text(path: str | Path, text: str) -> None:
    """Write ``text`` to ``path`` as UTF-8 with Unix line ends, whole or not at all."""
    atomic_write_bytes(path, text.encode("utf-8"))


def atomic_write_json(path: str | Path, value: Any) -> None:
    """Write ``value`` to ``path`` as indented JSON, whole or not at all.

    Args:
        path: The file to write.
        value: Built of mappings, sequences, numbers and strings; also of numpy arrays and
            scalars, dataclasses and paths. JSON knows no NaN or infinity: they become ``null``.

    Raises:
        TypeError: Something in ``value`` has no form in JSON; nothing is written.
    """
    text = json.dumps(jsonable(value), indent=2, ensure_ascii=False, allow_nan=False)
    atomic_write_text(path, text + "\n")


def write_sealed(path: str | Path, value: Mapping[str, Any]) -> None:
    """Write an object to ``path`` as JSON with a format version and a checksum of its content."""
    plain = jsonable({**value, "format": FORMAT})
    atomic_write_json(path, {**plain, "checksum": _checksum(plain)})


def read_sealed(path: str | Path) -> dict[str, Any]:
    """What ``write_sealed`` wrote; a file without version and checksum is of an earlier release.

    Raises:
        ValueError: It is damaged, or of another release; the message names it.
    """
    found = read_json(path)
    if not isinstance(found, dict):
        raise ValueError(f"{path} is damaged: expected a JSON object")
    checksum = found.pop("checksum", None)
    if found.get("format", FORMAT) != FORMAT:
        raise ValueError(
            f"{path} has format version {found['format']!r:.40}, this release reads {FORMAT}: give "
            "the command that wrote it again"
        )
    if checksum is None and "format" in found:
        raise ValueError(f"{path} is damaged: its checksum is missing")
    if checksum is not None and checksum != _checksum(found):
        raise ValueError(f"{path} is damaged: its content does not have its checksum")
    found.pop("format", None)
    return found


def _checksum(value: Any) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()


def read_json(path: str | Path) -> Any:
    """What ``atomic_write_json`` wrote.

    Raises:
        ValueError: The file is cut or otherwise no JSON; the message names it.
    """
    try:
        return json.loads(Path(path).read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{path} is damaged: expected JSON ({error})") from None


def jsonable(value: Any) -> Any:
    """``value`` made of dicts, lists, numbers, strings and None only; see ``atomic_write_json``."""
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, np.ndarray | np.generic):
        return jsonable(value.tolist())
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        # Not asdict: it deep-copies arrays before they are looked at.
        return {field.name: jsonable(getattr(value, field.name))
                for field in dataclasses.fields(value)}  # fmt: skip
    if isinstance(value, Mapping):
        return {str(key): jsonable(item) for key, item in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [jsonable(item) for item in value]
    raise TypeError(f"a {type(value).__name__} has no form in JSON: {value!r:.80}")


def remove_partial_files(folder: str | Path, older: float = 600.0) -> None:
    """Delete what a killed writer left in ``folder`` and below; call before work begins.

    Args:
        folder: Where to look.
        older: Seconds. What is younger may be the work of another process on the same folder.
    """
    for leftover in Path(folder).rglob(f"{_PARTIAL}*"):
        with contextlib.suppress(FileNotFoundError):
            if time.time() - leftover.stat().st_mtime > older:
                leftover.unlink()


def flush_to_disk(path: str | Path) -> None:
    """Wait until a file, or the names in a folder, would survive a power cut."""
    # Windows flushes no folders.
    if os.name == "nt" and Path(path).is_dir():
        return
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
