"""Measured logs: what can be mended is mended, and it is said."""

import numpy as np
import pytest
from swings import kinds, read, swing, write


def test_gaps_cut_a_trajectory(tmp_path):
    columns = swing()
    keep = np.ones(200, bool)
    keep[50:70] = keep[100] = False
    data = read(write(tmp_path / "log.csv", {k: v[keep] for k, v in columns.items()}))
    assert [run.name for run in data.trajectories] == ["log.csv part 1", "log.csv part 2"]
    assert [len(run.times) for run in data.trajectories] == [50, 129]
    (gap,) = [finding for finding in data.findings if finding.kind == "gap"]
    assert gap.numbers["longest_s"] == pytest.approx(21 * 0.05)
    assert "first after row 51" in gap.says
    (sampling,) = [finding for finding in data.findings if finding.kind == "sampling"]
    assert sampling.numbers["late"] == 1


def test_frequent_short_holes_are_how_a_log_was_sampled(tmp_path):
    columns = swing()
    keep = np.ones(200, bool)
    for row in range(10, 190, 12):  # every twelfth step lasts seven periods
        keep[row : row + 6] = False
    data = read(write(tmp_path / "log.csv", {k: v[keep] for k, v in columns.items()}))
    assert len(data.trajectories) == 1
    assert "gap" not in kinds(data)
    keep[100:170] = False
    data = read(write(tmp_path / "log.csv", {k: v[keep] for k, v in columns.items()}))
    (gap,) = [finding for finding in data.findings if finding.kind == "gap"]
    assert gap.numbers["gaps"] == 1
    assert gap.severity == "warning"


def test_repeated_times_are_dropped(csv):
    data = read(csv(lambda lines: [*lines[:10], lines[9], lines[9], *lines[10:]]))
    assert len(data.trajectories[0].times) == 200
    (finding,) = [finding for finding in data.findings if finding.kind == "repeated"]
    assert finding.says == "2 samples are copies of the one before (first in row 11); dropped."


@pytest.mark.parametrize(("rate", "decimals"), [(120, 2), (120, 3), (33, 2), (7, 1)])
def test_a_clock_rounded_in_print_is_evened(tmp_path, rate, decimals):
    true = swing(dt=1 / rate)
    printed = true | {"time": np.round(true["time"], decimals)}
    data = read(write(tmp_path / "log.csv", printed))
    (run,) = data.trajectories
    assert "rounded_clock" in kinds(data) and "repeated" not in kinds(data)
    assert len(run.times) == len(true["time"])
    assert np.abs(np.diff(run.times) * rate - 1).max() < 0.02
    assert np.abs(run.times - true["time"]).max() <= 10.0**-decimals
    assert np.array_equal(run.states[:, 0], np.unwrap(true["angle"]))


@pytest.mark.parametrize(("rate", "step"), [(50, 0.04), (4, 1.0), (30, 0.25)])
def test_several_rows_of_one_time_stamp_are_spread_over_it(tmp_path, rate, step):
    true = swing(dt=1 / rate)
    stamped = true | {"time": step * np.floor(true["time"] / step + 1e-9)}
    data = read(write(tmp_path / "log.csv", stamped))
    (run,) = data.trajectories
    assert "rounded_clock" in kinds(data) and "repeated" not in kinds(data)
    assert len(run.times) == len(true["time"])
    assert np.abs(np.diff(run.times) * rate - 1).max() < 0.03
    assert np.abs(run.times - stamped["time"]).max() <= step


@pytest.mark.parametrize("every", [1, 7])
def test_rows_that_are_written_twice_are_no_rounded_clock(tmp_path, every):
    once = swing()
    rows = np.sort(np.concatenate([np.arange(200), np.arange(0, 200, every)]))
    data = read(write(tmp_path / "log.csv", {name: v[rows] for name, v in once.items()}))
    (run,) = data.trajectories
    assert "repeated" in kinds(data) and "rounded_clock" not in kinds(data)
    assert np.allclose(run.times, once["time"])


def test_a_row_written_twice_is_no_rounded_clock(tmp_path):
    rows = np.insert(np.arange(200), 70, 70)
    columns = {name: values[rows] for name, values in swing().items()}
    data = read(write(tmp_path / "log.csv", columns))
    assert "repeated" in kinds(data) and "rounded_clock" not in kinds(data)


def test_a_lost_row_is_no_rounded_clock(tmp_path):
    columns = {name: np.delete(values, 124) for name, values in swing(250, dt=0.02).items()}
    columns["time"] = np.round(columns["time"], 2)
    data = read(write(tmp_path / "log.csv", columns))
    (run,) = data.trajectories
    assert "rounded_clock" not in kinds(data)
    assert np.array_equal(run.times, columns["time"])


@pytest.mark.parametrize("count", [1, 2, 3, 6, 12, 40])
def test_rows_lost_at_random_are_no_rounded_clock(tmp_path, count):
    """Of 900 rows 10 ms apart six that were lost made a clock of 10.07 ms, up to 8 ms off."""
    for seed in range(5):
        lost = np.random.default_rng(seed).choice(np.arange(1, 899), count, replace=False)
        columns = {name: np.delete(v, lost) for name, v in swing(900, dt=0.01).items()}
        columns["time"] = np.round(columns["time"], 2)
        data = read(write(tmp_path / f"log{seed}.csv", columns))
        assert "rounded_clock" not in kinds(data)
        np.testing.assert_array_equal(data.trajectories[0].times, columns["time"])


def test_jitter_is_kept_and_reported(tmp_path):
    rng = np.random.default_rng(0)
    t = np.cumsum(rng.uniform(0.03, 0.07, 200))
    columns = swing() | {"time": t, "angle": np.sin(t), "rate": np.cos(t)}
    data = read(write(tmp_path / "log.csv", columns))
    np.testing.assert_array_equal(data.trajectories[0].times, t)
    assert "nine in ten lie between 0.03" in data.findings[-1].says


@pytest.mark.parametrize("word", ["", "nan", "NaN", "null", "N/A"])
def test_missing_values_stay_missing(csv, word):
    def change(lines):
        lines[5] = f"0.2,{word},{lines[5].split(',')[2]},1"
        lines[1] = f"0.0,{word},{word},1"
        return lines

    data = read(csv(change))
    (run,) = data.trajectories
    assert len(run.times) == 199
    assert np.isnan(run.states).sum() == 1 and np.isnan(run.states[3, 0])
    assert "angle is missing in 1 of 199 samples, the first in row 6." in [
        finding.says for finding in data.findings
    ]


def test_unwrapping_looks_past_missing_values(tmp_path):
    turns = 4.0 * swing()["time"]
    wrapped = (turns + np.pi) % (2 * np.pi) - np.pi
    wrapped[20:23] = np.nan
    path = write(tmp_path / "log.npz", swing() | {"angle": wrapped, "rate": 0 * turns + 4})
    angle = read(path).trajectories[0].states[:, 0]
    known = np.isfinite(angle)
    np.testing.assert_allclose(angle[known], turns[known], atol=1e-9)


def test_sample_without_action_ends_a_piece(tmp_path):
    columns = swing()
    columns["voltage"][[50, 199]] = np.nan
    data = read(write(tmp_path / "log.npz", columns))
    assert [len(run.times) for run in data.trajectories] == [51, 149]
    assert all(np.isfinite(run.actions).all() for run in data.trajectories)
    assert "no_action" in kinds(data)


def test_samples_without_time_are_dropped(tmp_path):
    columns = swing()
    columns["time"][7] = np.nan
    data = read(write(tmp_path / "log.npz", columns))
    assert len(data.trajectories[0].times) == 199
    assert "untimed" in kinds(data)


def test_last_row_cut_off_is_left_out(csv):
    data = read(csv(lambda lines: [*lines[:-1], lines[-1][:8]]))
    assert len(data.trajectories[0].times) == 199
    assert kinds(data)[0] == "cut_off"


def test_short_pieces_are_left_out(tmp_path):
    columns = swing()
    columns["time"] = columns["time"] + np.where(np.arange(200) >= 197, 5.0, 0.0)
    data = read(write(tmp_path / "log.csv", columns))
    assert [len(run.times) for run in data.trajectories] == [197]
    (finding,) = [finding for finding in data.findings if finding.kind == "left_out"]
    assert finding.numbers["samples"] == 3


def test_a_header_in_the_middle_is_left_out_and_told(csv):
    data = read(csv(lambda lines: [*lines[:90], lines[0], *lines[90:], lines[0]]))
    plain = read(csv())
    np.testing.assert_array_equal(data.trajectories[0].states, plain.trajectories[0].states)
    (told,) = [finding.says for finding in data.findings if finding.kind == "headers"]
    assert "2 times" in told
