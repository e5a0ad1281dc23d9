"""Small files that declare huge contents: refused from what they declare, before it is claimed."""

from __future__ import annotations

import struct
import tracemalloc
import zipfile

import h5py
import numpy as np
import pyarrow
import pyarrow.parquet
import pytest
import yaml
from mcap.writer import CompressionType, Writer
from safetensors.numpy import save

import residual
from residual.logs import LogError, read_logs
from residual.trajectories import Transitions
from simgap_files import safe_yaml
from sims.loading import load_simulator
from sims.pendulum_equation import PendulumEquation

CHANNELS = PendulumEquation().state_channels, PendulumEquation().action_channels
GIGABYTE = 2**30
PAIRS = ("ab", "bc", "cd", "de")


def header(shape):
    """The beginning of an NPY file of these many zeros."""
    text = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text.encode()


def zipped(path):
    """4 GB of zeros in 4 MB."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        with archive.open("time.npy", "w", force_zip64=True) as member:
            member.write(header((GIGABYTE // 2,)))
        entry = archive.infolist()[0]
    content = bytearray(path.read_bytes())
    # The directory says what it likes: no need to pack 4 GB for a test.
    at = content.rindex(b"PK\x01\x02")
    content[at + 24 : at + 28] = struct.pack("<I", 2**32 - 2)
    assert entry.file_size < 1000
    path.write_bytes(content)


def lying(path):
    """An array that says to be 4 GB and is not."""
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("time.npy", header((GIGABYTE // 2,)) + bytes(80))


def unfilled(path):
    with h5py.File(path, "w") as file:
        for name in ("time", "angle", "rate", "voltage"):
            file.create_dataset(name, (10**12,), chunks=(1000,), dtype=float)


def elsewhere(path):
    (path.parent / "secret").write_bytes(bytes(800))
    with h5py.File(path, "w") as file:
        place = [(str(path.parent / "secret"), 0, 800)]
        file.create_dataset("time", (100,), float, external=place)


def repeated(path):
    column = pyarrow.DictionaryArray.from_arrays(
        pyarrow.array(np.zeros(35_000_000, np.int8)), pyarrow.array([0.0])
    )
    table = pyarrow.table({"time": column})
    pyarrow.parquet.write_table(table, path, row_group_size=35_000_000)


def packed(path):
    with path.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.ZSTD, chunk_size=2**40)
        writer.start()
        schema = writer.register_schema("any", "jsonschema", b"{}")
        topic = writer.register_channel("/a", "json", schema)
        blank = b"[" + b" " * 30_000_000 + b"]"
        for k in range(10):
            writer.add_message(topic, k, blank, k)
        writer.finish()


@pytest.mark.parametrize(
    ("make", "name"),
    [(zipped, "a.npz"), (lying, "a.npz"), (unfilled, "a.h5"), (elsewhere, "a.h5"),
     (repeated, "a.parquet"), (packed, "a.mcap")],
)  # fmt: skip
def test_a_log_that_would_fill_the_memory_is_refused(make, name, tmp_path):
    make(tmp_path / name)
    tracemalloc.start()
    try:
        with pytest.raises(LogError, match=name):
            read_logs([tmp_path / name], *CHANNELS)
        assert tracemalloc.get_traced_memory()[1] < 64 * 2**20
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("make", [zipped, lying])
def test_transitions_that_would_fill_the_memory_are_refused(make, tmp_path):
    make(tmp_path / "a.npz")
    with pytest.raises(ValueError, match=r"a\.npz"):
        Transitions.load(tmp_path / "a.npz")


def test_a_model_whose_header_declares_more_than_there_is(tmp_path):
    content = save({"a": np.zeros(4)})
    huge = content.replace(b'"shape":[4]', b'"shape":[9]').replace(b"[0,32]", b"[0,72]")
    (tmp_path / "model").write_bytes(huge)
    with pytest.raises(ValueError, match="model is damaged"):
        residual.load(tmp_path / "model")


@pytest.mark.parametrize(
    "text",
    [
        "simulator: &a\n  class_path: sims.Pendulum\n  init_args: *a\n",
        "a: &a [x, x]\n"
        + "".join(f"{b}: &{b} [{', '.join([f'*{a}'] * 20)}]\n" for a, b in PAIRS),
        "[" * 1200,
    ],
)  # fmt: skip
def test_settings_that_unfold_without_end_are_refused(text, tmp_path):
    with pytest.raises(yaml.YAMLError):
        safe_yaml.load(text)
    (tmp_path / "a.yaml").write_text(text)
    with pytest.raises(ValueError, match=r"a\.yaml"):
        load_simulator(tmp_path / "a.yaml")


def test_an_estimator_of_another_library_that_would_fill_the_memory(tmp_path):
    pytest.importorskip("skops")
    from sklearn.linear_model import Ridge

    from simgap_files.arrays import FileError, read_arrays, write_arrays

    X = np.random.default_rng(0).normal(size=(20, 2))
    residual.save(Ridge().fit(X, X), tmp_path / "ridge")
    header, arrays = read_arrays(tmp_path / "ridge")
    zipped(tmp_path / "bomb.npz")
    content = np.frombuffer((tmp_path / "bomb.npz").read_bytes(), np.uint8)
    (name,) = (name for name, array in arrays.items() if array.dtype == np.uint8 and array.size > 9)
    write_arrays(tmp_path / "bomb", header, {**arrays, name: content})
    with pytest.raises(FileError, match=r"bomb.*would unpack to 4\.29 GB"):
        residual.load(tmp_path / "bomb")
