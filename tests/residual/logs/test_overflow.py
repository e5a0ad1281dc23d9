"""Counters that overflow, angles that begin anew, and logs without times."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from residual.logs import LogError, LogFormat, read_logs
from residual.logs.layout import Column
from residual.logs.overflow import jumps_by
from sims.simulator import Channel

COUNTS = (Channel("place", "1", "position", scale=1000.0),)
TURNS = (Channel("angle", "rad", "position"),)


def text(path: Path, header: str, values, dt: float | None = 0.01) -> Path:
    rows = [f"{v:.10g}" if dt is None else f"{i * dt:.10g},{v:.10g}" for i, v in enumerate(values)]
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


def moved(count=200, speed=45.0, seed=0):
    """Counts of a wheel that turns at nearly even speed, or speeds up and turns back."""
    rng = np.random.default_rng(seed)
    return np.round(np.cumsum(speed + 5 * rng.standard_normal(count)))


@given(bits=st.sampled_from([10, 12, 14, 16]), start=st.integers(0, 60000), back=st.booleans(),
       signed=st.booleans(), seed=st.integers(0, 9))  # fmt: skip
def test_a_counter_that_overflows_goes_on(bits, start, back, signed, seed):
    true = start + (-1 if back else 1) * moved(400, 30.0, seed)
    size = 2**bits
    counted = true % size - (size // 2 if signed else 0)
    jump = jumps_by(counted, "1", 1.0)
    crossed = np.abs(np.diff(counted)).max() > size / 2
    assert (jump is not None) == crossed
    if jump is not None:
        assert jump.period == size
        assert np.array_equal(np.unwrap(counted, period=size) - counted[0], true - true[0])


@given(fine=st.sampled_from([0.02, 0.005, 1.25, 0.1]), start=st.integers(0, 65535),
       seed=st.integers(0, 9))  # fmt: skip
def test_counts_that_were_scaled_before_they_were_logged_go_on(fine, start, seed):
    """Two overflows tell that a position in millimetres was a counter's."""
    true = start + 3.0 * moved(1200, 45.0, seed)  # two rounds and a half
    logged = np.array([float(f"{fine * count:.10g}") for count in true % 65536])
    jump = jumps_by(logged, "mm", 1.0)
    assert jump is not None and jump.period == pytest.approx(65536 * fine, rel=1e-12)
    assert np.unwrap(logged, period=jump.period) - logged[0] == pytest.approx(
        fine * (true - true[0]), abs=0.01 * fine
    )
    first = slice(0, int(np.flatnonzero(np.diff(logged) < -30000 * fine)[0]) + 20)
    assert jumps_by(logged[first], "mm", 1.0) is None  # one jump alone may be anything


@pytest.mark.parametrize("values", [
    np.tile(0.02 * moved(), 4),  # was set back to where it began, again and again
    np.tile(np.r_[0.02 * moved(100), 1200 + 0.02 * moved(100)], 3),  # to and fro
    np.where(np.arange(400) % 100 == 70, 1310.7, 0.02 * moved(400)),  # wild readings
], ids=["reset", "elsewhere", "wild"])  # fmt: skip
def test_other_jumps_of_fine_values_stay(values):
    assert jumps_by(values, "mm", 1.0) is None


@pytest.mark.parametrize("values", [
    np.r_[moved(), moved()],  # was set back to where it began
    np.r_[moved(100), 70000 + moved(100)],  # another place
    np.r_[np.zeros(50), np.full(50, 65536.0 * 0.9)],
    np.where(np.arange(200) == 70, 65535, moved()),  # a single wild reading
    np.tile([0.0, 200.0], 50),
], ids=["reset", "elsewhere", "step", "wild", "square"])  # fmt: skip
def test_other_jumps_stay(values):
    assert jumps_by(values, "1", 1.0) is None


def test_it_is_told_and_read_on(tmp_path):
    true = 65000 + moved()
    data = read_logs([text(tmp_path / "log.csv", "time,place", true % 65536)], COUNTS, ())
    assert np.array_equal(data.trajectories[0].states[:, 0], true)
    (finding,) = [finding for finding in data.findings if finding.kind == "unwrapped"]
    assert finding.says == (
        "place jumped by 65536, as a counter of 16 bits does, once, and was continued there."
    )


def test_counts_of_an_encoder_are_scaled_as_the_map_says(tmp_path):
    true = 3900 + moved(count=150)
    path = text(tmp_path / "log.csv", "time,angle", true % 65536 - 32768)
    columns = LogFormat(states={"angle": Column("angle", scale=-2 * np.pi / 4096)})
    states = read_logs([path], TURNS, (), columns).trajectories[0].states[:, 0]
    assert np.diff(states) == pytest.approx(-2 * np.pi / 4096 * np.diff(true))
    again = read_logs([text(path, "time,angle", (60000 + true) % 65536)], TURNS, (), columns)
    assert np.diff(again.trajectories[0].states[:, 0]) == pytest.approx(np.diff(states))
    assert "a counter of 16 bits" in again.findings[0].says


def test_an_angle_that_is_not_declared_as_one_goes_on_after_a_turn(tmp_path):
    true = 170 + 3.0 * np.arange(200)
    path = text(tmp_path / "log.csv", "time,angle", (true + 180) % 360 - 180)
    columns = LogFormat(states={"angle": Column("angle", "deg", scale=-1.0, offset=0.5)})
    data = read_logs([path], TURNS, (), columns)
    assert data.trajectories[0].states[:, 0] == pytest.approx(0.5 - np.deg2rad(true))
    assert "a whole turn 2 times" in data.findings[0].says


def test_a_text_without_times_has_those_of_its_period(tmp_path):
    path = text(tmp_path / "log.csv", "place", moved(), dt=None)
    with pytest.raises(LogError, match=r"period: 0\.01"):
        read_logs([path], COUNTS, ())
    data = read_logs([path], COUNTS, (), LogFormat(period=0.02))
    assert data.trajectories[0].times == pytest.approx(0.02 * np.arange(200))


def test_a_period_that_the_times_contradict_is_refused(tmp_path):
    path = text(tmp_path / "log.csv", "time,place", moved())
    assert read_logs([path], COUNTS, (), LogFormat(period=0.01)).trajectories
    with pytest.raises(LogError, match=r"period is 0\.02 s, .* 0\.01 s apart: leave out period"):
        read_logs([path], COUNTS, (), LogFormat(period=0.02))


def test_an_encoder_in_degrees_goes_on_over_its_turns():
    turning = np.cumsum(np.full(200, 7.0)) % 360.0
    assert jumps_by(turning, "deg", 1.0).period == 360.0
    assert jumps_by(turning, "m", 1.0) is None
