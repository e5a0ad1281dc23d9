"""Stages are computed once, keep apart what differs, and survive a kill."""

import multiprocessing
import os
import signal
import time

import pytest

from studies.learning.stages import Stages


def write(text):
    return lambda folder: (folder / "value.txt").write_text(text)


def test_a_stage_is_computed_once_per_configuration(tmp_path):
    stages = Stages(tmp_path)
    first = stages.run("a", {"x": 1}, write("one"))
    again = stages.run("a", {"x": 1}, write("never"))
    other = stages.run("a", {"x": 2}, write("two"))
    assert first == again and (again / "value.txt").read_text() == "one"
    assert other != first and (other / "value.txt").read_text() == "two"


def test_what_follows_from_another_stage_is_another_stage(tmp_path):
    stages = Stages(tmp_path)
    one, two = (stages.run("a", {"x": x}, write("")) for x in (1, 2))
    assert stages.run("b", {"on": one}, write("")) != stages.run("b", {"on": two}, write(""))


def test_a_failed_stage_leaves_nothing_that_counts_as_finished(tmp_path):
    stages = Stages(tmp_path)

    def fail(folder):
        (folder / "value.txt").write_text("half")
        raise RuntimeError("no")

    with pytest.raises(RuntimeError):
        stages.run("a", {}, fail)
    folder = stages.run("a", {}, write("whole"))
    assert (folder / "value.txt").read_text() == "whole"
    assert [path.name for path in tmp_path.iterdir() if path.is_dir()] == [folder.name]


def test_a_configuration_that_cannot_be_described_is_refused(tmp_path):
    with pytest.raises(TypeError, match="configuration"):
        Stages(tmp_path).run("a", {"x": object()}, write(""))


def _slow(root, marker):
    def compute(folder):
        (folder / "value.txt").write_text("half")
        open(marker, "w").close()
        time.sleep(60)

    Stages(root).run("a", {}, compute)


def test_a_killed_stage_is_computed_again_and_cleaned_up(tmp_path):
    marker = tmp_path / "marker"
    root = tmp_path / "stages"
    process = multiprocessing.get_context("spawn").Process(target=_slow, args=(root, str(marker)))
    process.start()
    while not marker.exists():
        time.sleep(0.01)
    os.kill(process.pid, signal.SIGKILL)
    process.join()
    folder = Stages(root).run("a", {}, write("whole"))
    assert (folder / "value.txt").read_text() == "whole"
    assert [path.name for path in root.iterdir() if path.is_dir()] == [folder.name]
