"""Sound logs of every kind, to be damaged."""

from __future__ import annotations

import json
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pyarrow
import pyarrow.parquet
from mcap.writer import CompressionType, Writer

from residual.logs import LogFormat
from sims.pendulum_equation import PendulumEquation

SIMULATOR = PendulumEquation()
TIMES = np.round(0.02 * np.arange(80), 6)
ANGLE = np.round(0.7 * np.sin(3 * TIMES), 5)
RATE = np.round(2.1 * np.cos(3 * TIMES), 5)
VOLTAGE = np.round(2 * np.sin(5 * TIMES), 4)
TABLE = {"time": TIMES, "angle": ANGLE, "rate": RATE, "voltage": VOLTAGE}
TEXT = {"csv": (",", "."), "tsv": ("\t", "."), "txt": (" ", "."), "semicolon": (";", ",")}
BINARY = ("npz", "packed", "parquet", "h5", "minari", "mcap", "lerobot", "frame")
SPLIT = {"states": {"angle": "x.0", "rate": "x.1"}, "actions": {"voltage": "u.0"}}
LAYOUTS = {
    "semicolon": LogFormat(decimal=","),
    "h5": LogFormat(**SPLIT),
    "minari": LogFormat(**SPLIT, period=0.02),
    "mcap": LogFormat(
        states={"angle": "/joints.position.pivot", "rate": "/joints.velocity.pivot"},
        actions={"voltage": "/command.data.0"},
    ),
    "lerobot": LogFormat(**SPLIT),
}
_places: dict[str, Path] = {}


def folder_of(kind: str) -> Path:
    """Where a sound log was written."""
    return _places[kind]


def sound(kind: str, folder: Path) -> tuple[Path, Path]:
    """A sound log of this kind, and the file of it that is damaged."""
    source = folder / {"semicolon": "semicolon.csv", "packed": "packed.npz"}.get(
        kind, f"log.{kind}" if kind not in ("minari", "lerobot") else kind
    )
    file = {
        "minari": source / "data" / "main_data.hdf5",
        "lerobot": source / "data" / "chunk-000" / "episode_000000.parquet",
    }.get(kind, source)
    if kind != "frame" and not file.exists():
        file.parent.mkdir(parents=True, exist_ok=True)
        _WRITERS.get(kind, _text)(file)
    if kind == "txt":
        LAYOUTS["txt"] = LogFormat(delimiter="blank")
    _places[kind] = source
    return source, file


def _text(path: Path) -> None:
    kind = "semicolon" if path.stem == "semicolon" else path.suffix[1:]
    between, decimal = TEXT[kind]
    rows = [between.join(TABLE)]
    rows += [
        between.join(f"{x:.6g}".replace(".", decimal) for x in row)
        for row in zip(*TABLE.values(), strict=True)
    ]
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")


def _hdf5(path: Path) -> None:
    pairs = np.stack([ANGLE, RATE], axis=1)
    with h5py.File(path, "w", libver="latest") as file:
        if path.name == "main_data.hdf5":
            for k in range(2):
                file[f"episode_{k}/x"], file[f"episode_{k}/u"] = pairs, VOLTAGE[:-1, None]
            return
        for name, values in (("time", TIMES), ("x", pairs), ("u", VOLTAGE[:, None])):
            file.create_dataset(name, data=values, fletcher32=True, compression="gzip")


def _mcap(path: Path) -> None:
    with path.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.ZSTD, chunk_size=2000)
        writer.start()
        schema = writer.register_schema("any", "jsonschema", b"{}")
        topics = [writer.register_channel(n, "json", schema) for n in ("/joints", "/command")]
        for k, t in enumerate(TIMES):
            at = round(t * 1e9)
            joints = {"name": ["pivot"], "position": [ANGLE[k]], "velocity": [RATE[k]]}
            for topic, message in zip(topics, (joints, {"data": [VOLTAGE[k]]}), strict=True):
                writer.add_message(topic, at, json.dumps(message).encode(), at)
        writer.finish()


def _parquet(path: Path) -> None:
    table = pyarrow.table(TABLE)
    pyarrow.parquet.write_table(table, path, write_page_checksum=True)


def _lerobot(path: Path) -> None:
    meta = path.parents[2] / "meta"
    meta.mkdir(exist_ok=True)
    (meta / "info.json").write_text(json.dumps({"fps": 50, "features": {}}))
    frame = {"x": list(np.stack([ANGLE, RATE], axis=1)), "u": list(VOLTAGE[:, None])}
    pd.DataFrame({**frame, "timestamp": TIMES, "episode_index": 0}).to_parquet(path)


_WRITERS = {
    "npz": lambda path: np.savez(path, **TABLE),
    "packed": lambda path: np.savez_compressed(path, **TABLE),
    "parquet": _parquet, "h5": _hdf5, "minari": _hdf5, "mcap": _mcap, "lerobot": _lerobot,
}  # fmt: skip
