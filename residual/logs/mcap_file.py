"""MCAP recordings (JSON, protobuf, ROS 2) as signals; needs the extra ``logs``."""

from __future__ import annotations

import importlib
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from residual.logs.clocks import Signal
from residual.logs.table import LogError, shortened
from simgap_files.npz import check_unpacked

#: Decoders by the encoding of a channel's messages, and the package of each.
DECODERS = {
    "protobuf": ("mcap_protobuf.decoder", "mcap-protobuf-support"),
    "cdr": ("mcap_ros2.decoder", "mcap-ros2-support"),
}
#: Lists of names beside lists of numbers: joint states name their entries so.
NAMES = ("name", "names", "joint_names", "joint_name")


def read_mcap(path: Path) -> dict[str, Signal]:
    """Every number of every topic, by ``topic.field``; entries of joint states by joint.

    Times are those of the messages' headers if all topics have them, else those at which the
    messages were recorded, so that all share a clock.

    Args:
        path: The file.

    Returns:
        Such as ``{"/joint_states.position.elbow": ..., "/commands.data.0": ...}``.

    Raises:
        LogError: The file is broken or empty, an encoding is unknown, or a package is missing.
    """
    rows: dict[str, list[tuple[int, int | None, dict[str, float]]]] = {}
    try:
        for topic, recorded, message in _messages(path):
            numbers = dict(_numbers(message))
            if numbers:
                rows.setdefault(topic, []).append((recorded, _stamp(message), numbers))
    except LogError:
        raise
    except Exception as error:  # on broken bytes these libraries raise nearly anything
        reason = " ".join(str(error).split()) or type(error).__name__
        raise LogError(
            f"cannot be read as MCAP ({shortened(reason)}); write the file again", path
        ) from error
    if not rows:
        raise LogError("holds no message with a number", path)
    stamped = all(stamp is not None for messages in rows.values() for _, stamp, _ in messages)
    # Whole nanoseconds: seconds since 1970 would leave only a tenth of a microsecond.
    clocks: dict[str, NDArray[np.int64]] = {
        topic: np.array([stamp if stamped else recorded for recorded, stamp, _ in messages])
        for topic, messages in rows.items()
    }
    first = min(int(clock.min()) for clock in clocks.values())
    found: dict[str, Signal] = {}
    for topic, messages in rows.items():
        order = np.argsort(clocks[topic], kind="stable")
        times, keep = np.unique(clocks[topic][order], return_index=True)
        seconds = np.asarray((times - first) * 1e-9, np.float64)
        for field in {name: None for _, _, numbers in messages for name in numbers}:
            values = np.array([numbers.get(field, np.nan) for _, _, numbers in messages], float)
            found[f"{topic}.{field}"] = Signal(seconds, values[order][keep], topic)
    return found


def _messages(path: Path) -> Iterator[tuple[str, int, Any]]:
    try:
        reader = importlib.import_module("mcap.reader")
    except ImportError:
        raise LogError(
            "MCAP needs the package mcap: `pip install mcap` (extra `logs`)", path
        ) from None
    size = path.stat().st_size
    _check_chunks(path, size)
    with path.open("rb") as stream:
        opened = reader.SeekingReader(stream, validate_crcs=True, record_size_limit=size)
        summary = opened.get_summary()
        channels = summary.channels.values() if summary else ()
        decoders = {}
        for encoding in {channel.message_encoding for channel in channels} - {"json"}:
            decoders[encoding] = _decoder(encoding, path)
        for schema, channel, message in opened.iter_messages():
            encoding = channel.message_encoding
            if encoding == "json":
                content = json.loads(message.data)
            else:
                factory = decoders.get(encoding) or _decoder(encoding, path)
                decode = factory.decoder_for(encoding, schema)
                if decode is None:
                    continue
                content = decode(message.data)
            yield channel.topic, message.log_time, content


def _check_chunks(path: Path, size: int) -> None:
    """Refuse chunks that would unpack to far more than lies on disk."""
    records = importlib.import_module("mcap.records")
    reader = importlib.import_module("mcap.stream_reader")
    unpacked = 0
    with path.open("rb") as stream:
        found = reader.StreamReader(stream, emit_chunks=True, record_size_limit=size)
        for record in found.records:
            if isinstance(record, records.Chunk):
                unpacked += max(record.uncompressed_size, _declared(record))
                check_unpacked("the file", unpacked, size)


def _declared(chunk: Any) -> int:
    """Bytes that a compressed frame says it holds; zero if it does not say."""
    if chunk.compression == "zstd":
        zstd = importlib.import_module("zstandard")
        size = int(zstd.get_frame_parameters(chunk.data).content_size)
        return 0 if size == zstd.CONTENTSIZE_UNKNOWN else size
    if chunk.compression == "lz4":
        return int(importlib.import_module("lz4.frame").get_frame_info(chunk.data)["content_size"])
    return 0


def _decoder(encoding: str, path: Path) -> Any:
    if encoding not in DECODERS:
        known = ", ".join(("json", *DECODERS))
        raise LogError(f"holds messages encoded as {encoding!r}, expected one of {known}", path)
    module, package = DECODERS[encoding]
    try:
        return importlib.import_module(module).DecoderFactory()
    except ImportError:
        raise LogError(
            f"holds {encoding} messages, which need the package {package}: "
            f"`pip install {package}` (extra `logs`)",
            path,
        ) from None


def _numbers(message: Any, prefix: str = "") -> Iterator[tuple[str, float]]:
    """Numbers of a message by their field, depth first."""
    fields = _fields(message)
    names: Sequence[Any] = ()
    for key in NAMES:
        value = fields.get(key)
        if isinstance(value, Sequence) and not isinstance(value, str) and len(value):
            names = [str(name) for name in value]
    for key, value in fields.items():
        full = f"{prefix}{key}"
        if key == "header" or isinstance(value, str | bytes) or value is None:
            continue
        if isinstance(value, bool | int | float | np.number):
            yield full, float(value)
        elif _is_list(value):
            for i, item in enumerate(value):
                name = names[i] if len(names) == len(value) else str(i)
                if isinstance(item, bool | int | float | np.number):
                    yield f"{full}.{name}", float(item)
                elif not isinstance(item, str | bytes):
                    yield from _numbers(item, f"{full}.{name}.")
        else:
            yield from _numbers(value, f"{full}.")


def _is_list(value: Any) -> bool:
    return (
        hasattr(value, "__len__")
        and hasattr(value, "__getitem__")
        and not isinstance(value, Mapping)
    )


def _fields(message: Any) -> dict[str, Any]:
    """Fields of a JSON object, a ROS message or a protobuf message."""
    if isinstance(message, Mapping):
        return dict(message)
    if hasattr(message, "DESCRIPTOR"):
        return {field.name: getattr(message, field.name) for field in message.DESCRIPTOR.fields}
    if hasattr(message, "__slots__"):
        return {key.lstrip("_"): getattr(message, key) for key in message.__slots__}
    return {k: v for k, v in getattr(message, "__dict__", {}).items() if not k.startswith("_")}


def _stamp(message: Any) -> int | None:
    """Time of a message's header in ns, None without one; a zero means that it was not set."""
    header = _fields(message).get("header")
    stamp = _fields(header).get("stamp") if header is not None else None
    if stamp is None:
        return None
    fields = _fields(stamp)
    seconds = fields.get("sec", fields.get("secs", fields.get("seconds")))
    if seconds is None:
        return None
    nanoseconds = fields.get("nanosec", fields.get("nsecs", fields.get("nanos", 0)))
    return int(seconds) * 1_000_000_000 + int(nanoseconds) or None
