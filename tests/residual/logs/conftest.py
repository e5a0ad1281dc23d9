"""Fixtures of the tests of logs."""

import pytest
from swings import swing, write


@pytest.fixture
def csv(tmp_path):
    """A function that writes a CSV of a swing whose lines it may change."""

    def make(change=lambda lines: lines, **columns):
        path = write(tmp_path / "log.csv", swing() | columns)
        path.write_text("\n".join(change(path.read_text().splitlines())) + "\n")
        return path

    return make
