"""Inputs that are logged in fewer rows than the states, as where topics are joined by time."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from swings import ACTIONS, STATES, error, kinds, read, swing, write

from residual.logs import LogFormat, read_logs


def logged_in(columns, rows):
    """The same log with the voltage in some rows only."""
    volts = np.full(len(columns["time"]), "", dtype=object)
    volts[rows] = columns["voltage"][rows]
    return columns | {"voltage": volts}


@pytest.mark.parametrize("every", [2, 5, 10])
def test_a_command_is_held_until_the_next(tmp_path, every):
    columns = swing()
    path = write(tmp_path / "log.csv", logged_in(columns, np.arange(0, 200, every)))
    data = read(path)
    (run,) = data.trajectories
    (finding,) = [f for f in data.findings if f.kind == "slower_input"]
    assert finding.numbers["every_s"] == pytest.approx(every * 0.05)
    rows = np.arange(199) // every * every
    np.testing.assert_array_equal(run.actions[:, 0], columns["voltage"][rows])


def test_a_measured_input_runs_straight_between_its_readings(tmp_path):
    columns = swing() | {"voltage": np.sin(np.arange(200) * 0.1)}
    path = write(tmp_path / "log.csv", logged_in(columns, np.arange(0, 200, 4)))
    linear = tuple(dataclasses.replace(channel, hold="linear") for channel in ACTIONS)
    (run,) = read_logs([path], STATES, linear, LogFormat()).trajectories
    np.testing.assert_allclose(
        run.actions[:, 0], columns["voltage"][: len(run.actions)], atol=0.025
    )


@given(seed=st.integers(0, 99))
def test_rows_of_two_topics_are_joined_by_time(tmp_path_factory, seed):
    """Commands stand in rows of their own, between those of the encoder."""
    rng = np.random.default_rng(seed)
    columns, late = swing(), 0.01 + 0.03 * rng.random(67)
    rows = [
        (t, f"{a}", f"{v}", "")
        for t, a, v in zip(columns["time"], columns["angle"], columns["rate"], strict=True)
    ]
    volts = rng.uniform(-1, 1, 67)
    rows += [(t, "", "", f"{u}") for t, u in zip(0.15 * np.arange(67) + late, volts, strict=True)]
    rows.sort()
    path = tmp_path_factory.mktemp("log") / "log.csv"
    lines = [",".join(map(str, row)) for row in rows]
    path.write_text("\n".join(["time,angle,rate,voltage", *lines]))
    (run,) = read(path).trajectories
    there = np.isfinite(run.states[:-1, 0])
    held = np.searchsorted(0.15 * np.arange(67) + late, run.times[:-1][there], side="right") - 1
    np.testing.assert_allclose(run.actions[there, 0], volts[held])


def test_what_is_blank_now_and_then_is_cut_there(tmp_path):
    path = write(tmp_path / "log.csv", logged_in(swing(), np.delete(np.arange(200), [50, 51, 120])))
    data = read(path)
    assert len(data.trajectories) == 3 and "slower_input" not in kinds(data)


def test_long_after_the_last_reading_a_command_is_not_known(tmp_path):
    rows = np.delete(np.arange(0, 200, 4), slice(20, 30))
    data = read(write(tmp_path / "log.csv", logged_in(swing(), rows)))
    first, second = data.trajectories
    assert first.times[-1] == pytest.approx(76 * 0.05 + 3 * 0.2 + 0.05)
    assert second.times[0] == pytest.approx(120 * 0.05)


def test_a_few_readings_are_no_rhythm(tmp_path):
    path = write(tmp_path / "log.csv", logged_in(swing(), [0, 50, 100, 150]))
    assert "samples without an action" in error(path)
