"""NPZ files: a checksum tells whether the arrays came back, and no file claims much memory.

Our files carry format version and checksum as the comment of their ZIP archive, so that
``np.load`` reads them like any other.
"""

from __future__ import annotations

import hashlib
import io
import json
import math
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from simgap_files.arrays import FileError
from simgap_files.atomic import atomic_path

VERSION = 2
#: What may always be unpacked, in bytes; more only if the file is not much smaller than that.
_SMALL, _RATIO = 2**28, 100
_END_RECORD = 22  # bytes before the comment, with which a ZIP archive ends (APPNOTE 4.3.16)
_HEADERS = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}


def check_unpacked(what: str | Path, unpacked: int, packed: int) -> None:
    """Refuse what a few bytes would make of much memory, before a byte is claimed.

    Raises:
        FileError: More than 256 MB, and more than 100 times what lies on disk.
    """
    if unpacked > _SMALL and unpacked > _RATIO * packed:
        raise FileError(
            f"{what} would unpack to {unpacked / 1e9:.3g} GB from {packed / 1e6:.3g} MB, expected "
            f"at most {_RATIO} times as much: it is damaged, or made to fill the memory"
        )


def write_npz(path: str | Path, arrays: Mapping[str, NDArray[Any]], compress: bool = True) -> None:
    """Write arrays by name, whole or not at all; the same arrays give the same bytes."""
    plain = {name: np.asarray(array) for name, array in arrays.items()}
    with atomic_path(path) as temporary:
        keywords: dict[str, Any] = plain
        with open(temporary, "wb") as file:  # a path would get another suffix
            (np.savez_compressed if compress else np.savez)(file, **keywords)
        with zipfile.ZipFile(temporary, "a") as archive:
            says = {"simgap": VERSION, "checksum": _checksum(plain)}
            archive.comment = json.dumps(says).encode()


def read_npz(path: str | Path, content: bytes | None = None) -> dict[str, NDArray[Any]]:
    """Arrays by name from an NPZ file, ours or any other; nothing of it is executed.

    Args:
        path: The file.
        content: Its bytes, if they were read already.

    Raises:
        FileNotFoundError: There is no such file.
        FileError: It is damaged, would fill the memory, or holds something else than numbers,
            texts and dates.
    """
    if content is None and not Path(path).is_file():
        raise FileNotFoundError(f"there is no file {path}")
    try:
        size = Path(path).stat().st_size if content is None else len(content)
        with (
            open(path, "rb") if content is None else io.BytesIO(content) as stream,
            zipfile.ZipFile(stream) as archive,
        ):
            _check_end(stream, archive)
            entries = archive.infolist()
            check_unpacked(path, sum(entry.file_size for entry in entries), size)
            arrays = {e.filename.removesuffix(".npy"): _array(archive, e) for e in entries}
            if len(arrays) < len(entries):
                raise ValueError("two arrays have one name")
            says = json.loads(archive.comment) if archive.comment else {}
    except FileError:
        raise
    # Broken bytes make zip, zlib and numpy raise nearly anything.
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise FileError(f"{path} is damaged or no NPZ file ({reason}): write it again") from None
    if isinstance(says, dict) and "simgap" in says:
        if says["simgap"] != VERSION:
            raise FileError(
                f"{path} has format version {says['simgap']!r}, this release reads {VERSION}: "
                "write it again with this release"
            )
        if says.get("checksum") != _checksum(arrays):
            raise FileError(f"{path} is damaged: its content does not have its checksum")
    return arrays


def _check_end(stream: BinaryIO, archive: zipfile.ZipFile) -> None:
    """What lost its comment, or its list of arrays, has bytes behind its end, or no arrays."""
    stream.seek(-_END_RECORD - len(archive.comment), io.SEEK_END)
    if not archive.infolist() or stream.read(4) != b"PK\x05\x06":
        raise ValueError("it does not end as an archive of arrays does")


def _array(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> NDArray[Any]:
    """One array; its header is believed only if the bytes that follow are as many as it says."""
    with archive.open(entry) as member:
        version = np.lib.format.read_magic(member)
        if version not in _HEADERS:
            raise ValueError(f"array {entry.filename} has NPY version {version}")
        shape, by_column, kind = _HEADERS[version](member)
        if kind.hasobject:
            raise ValueError(f"array {entry.filename} holds Python objects, expected numbers")
        data = member.read()
    if min(shape, default=0) < 0 or math.prod(shape) * kind.itemsize != len(data):
        raise ValueError(f"array {entry.filename} is {len(data)} bytes, not {shape} of {kind}")
    flat = np.frombuffer(bytearray(data), kind)
    return flat.reshape(shape, order="F" if by_column else "C")


def _checksum(arrays: Mapping[str, NDArray[Any]]) -> str:
    found = hashlib.sha256()
    for name in sorted(arrays):
        array = arrays[name]
        found.update(json.dumps([name, array.dtype.str, array.shape]).encode())
        found.update(array.tobytes())
    return found.hexdigest()
