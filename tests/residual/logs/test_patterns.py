"""Patterns in place of files, as where no shell has expanded them."""

import pytest
from swings import ACTIONS, STATES, read, swing, write

from residual.logs import LogError, read_logs


def test_a_pattern_stands_for_the_files_that_match(tmp_path):
    names = ["b.csv", "a.csv", "a[1].csv"]
    for name in names:
        write(tmp_path / name, swing())
    every = read_logs(str(tmp_path / "*.csv"), STATES, ACTIONS)
    named = read_logs([tmp_path / name for name in sorted(names)], STATES, ACTIONS)
    assert [run.name for run in every.trajectories] == [run.name for run in named.trajectories]
    assert len(read(tmp_path / "a[1].csv").trajectories) == 1  # a file of that name goes first


def test_a_pattern_that_nothing_matches_is_named(tmp_path):
    with pytest.raises(LogError, match=r"none\*\.csv: no file matches"):
        read_logs(str(tmp_path / "none*.csv"), STATES, ACTIONS)
