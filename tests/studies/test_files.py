"""What is written to disk is whole or not there."""

import dataclasses
import json
import os

import numpy as np
import pytest

from simgap_files.atomic import (
    atomic_path,
    atomic_write_bytes,
    atomic_write_json,
    atomic_write_text,
    remove_partial_files,
)


def test_failed_write_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "results.json"
    atomic_write_json(path, {"a": 1})
    with pytest.raises(TypeError, match="has no form in JSON"):
        atomic_write_json(path, {"a": object()})
    with pytest.raises(RuntimeError), atomic_path(path) as temporary:
        temporary.write_text("half")
        raise RuntimeError
    assert json.loads(path.read_text()) == {"a": 1}
    assert list(tmp_path.iterdir()) == [path]


def test_json_takes_arrays_dataclasses_paths_and_gaps(tmp_path):
    @dataclasses.dataclass
    class Score:
        mean: float
        path: object

    value = {"x": np.array([1.5, np.nan]), 2: Score(np.float64(np.inf), tmp_path), "n": np.int64(3)}
    atomic_write_json(tmp_path / "a.json", value)
    assert json.loads((tmp_path / "a.json").read_text()) == {
        "x": [1.5, None],
        "2": {"mean": None, "path": str(tmp_path)},
        "n": 3,
    }


def test_temporary_name_keeps_the_suffix_so_that_writers_add_none(tmp_path):
    with atomic_path(tmp_path / "data.npz") as temporary:
        np.savez(temporary, a=np.arange(3))
    with np.load(tmp_path / "data.npz") as data:
        np.testing.assert_array_equal(data["a"], [0, 1, 2])


def test_leftovers_of_a_killed_writer_are_swept(tmp_path):
    writer = atomic_path(tmp_path / "b" / "results.json")
    temporary = writer.__enter__()
    temporary.write_text("half")
    atomic_write_text(tmp_path / "keep.txt", "ä\n")
    atomic_write_bytes(tmp_path / "keep.bin", b"\x00")
    remove_partial_files(tmp_path)
    assert temporary.exists()  # another process may be about to finish it
    os.utime(temporary, (0, 0))
    remove_partial_files(tmp_path)
    left = {path.name for path in tmp_path.rglob("*") if path.is_file()}
    assert left == {"keep.txt", "keep.bin"}
    assert (tmp_path / "keep.txt").read_bytes() == "ä\n".encode()
