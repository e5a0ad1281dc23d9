"""Measured logs: what is good is read exactly."""

import datetime

import jsonargparse
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import constants
from swings import ACTIONS, STATES, error, kinds, read, swing, write

from residual.logs import Column, LogFormat, read_logs
from residual.logs.units import USUAL, find_unit, units_of
from sims.simulator import Channel


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".npz"])
def test_every_format_is_read_exactly(tmp_path, suffix):
    columns = swing()
    data = read(write(tmp_path / f"log{suffix}", columns))
    (run,) = data.trajectories
    np.testing.assert_array_equal(run.times, columns["time"])
    np.testing.assert_array_equal(run.states, np.column_stack([columns["angle"], columns["rate"]]))
    np.testing.assert_array_equal(run.actions[:, 0], columns["voltage"][:-1])
    assert kinds(data) == ["sampling"]


@settings(max_examples=30)
@given(
    unit=st.sampled_from(["deg", "mrad", "rev", "°"]),
    rate_unit=st.sampled_from(["deg/s", "rpm", "rev/s"]),
    time_unit=st.sampled_from(["ms", "us", "min"]),
    scale=st.sampled_from([-1.0, 1.0, 2.5]),
    offset=st.floats(-3, 3),
    size=st.floats(0.05, 1.5),
)
def test_units_sign_and_offset_are_undone_at_the_border(
    tmp_path_factory, unit, rate_unit, time_unit, scale, offset, size
):
    columns = swing(size=size)
    logged = {
        "clock": columns["time"] / find_unit(time_unit, "s").factor,
        "a": (columns["angle"] - offset) / scale / find_unit(unit, "rad").factor,
        "b": columns["rate"] / scale / find_unit(rate_unit, "rad/s").factor,
        "mV": 1000 * columns["voltage"],
    }
    path = write(tmp_path_factory.mktemp("log") / "log.csv", logged)
    (run,) = read(
        path,
        time=Column("clock", time_unit),
        states={"angle": Column("a", unit, scale, offset), "rate": Column("b", rate_unit, scale)},
        actions={"voltage": Column("mV", "mV")},
    ).trajectories
    np.testing.assert_allclose(run.times, columns["time"], atol=1e-9)
    np.testing.assert_allclose(run.states[:, 0], columns["angle"], atol=1e-9)
    np.testing.assert_allclose(run.states[:, 1], columns["rate"], atol=1e-9)
    np.testing.assert_allclose(run.actions[:, 0], columns["voltage"][:-1], atol=1e-12)


def test_units_agree_with_their_definitions():
    assert find_unit("degC", "K") == (1.0, 273.15)
    freezing = find_unit("degF", "K")
    assert freezing.factor * 32 + freezing.offset == pytest.approx(273.15)
    assert find_unit("rpm", "rad/s").factor * 60 == pytest.approx(2 * np.pi)
    for hourly in ("km/h", "kph", "kmph"):
        assert find_unit(hourly, "m/s").factor * 36 == pytest.approx(10)
    assert find_unit("knots", "m/s").factor * 3600 == pytest.approx(find_unit("nmi", "m").factor)
    assert find_unit("fpm", "m/s").factor * 60 == pytest.approx(find_unit("ft", "m").factor)
    assert find_unit("", "counts") == (1.0, 0.0)
    assert find_unit("kg", "g").factor == pytest.approx(1000)


@pytest.mark.parametrize(
    ("unit", "target", "factor"),
    [
        ("mmHg", "Pa", constants.mmHg),
        ("psi", "Pa", constants.psi),
        ("L/min", "m3/s", constants.liter / constants.minute),
        ("inches", "m", constants.inch),
        ("lbf", "N", constants.lbf),
        ("g", "m/s2", constants.g),
        ("g", "kg", constants.gram),
        ("mNm", "N m", 1e-3),
        ("kWh", "J", constants.kilo * constants.hour),
        ("mK", "K", 1e-3),
        ("deg/s^2", "rad/s²", constants.degree),
        ("m s-2", "cm/s2", 100),
        ("°C/min", "K/s", 1 / 60),
    ],
)
def test_any_unit_that_measures_the_same_is_converted(unit, target, factor):
    assert find_unit(unit, target).factor == pytest.approx(factor, rel=1e-5)
    assert find_unit(unit, target).offset == 0


@given(st.data())
def test_there_and_back_is_where_one_was(data):
    target = data.draw(st.sampled_from(USUAL))
    unit = data.draw(st.sampled_from(units_of(target)))
    there, back = find_unit(unit, target), find_unit(target, unit)
    value = data.draw(st.floats(-1e3, 1e3))
    once = there.factor * value + there.offset
    assert back.factor * once + back.offset == pytest.approx(value, abs=1e-7 * back.factor + 1e-9)


@pytest.mark.parametrize("unit", ["1/s", "Hz", "m/s", "dBm", "furlongz", "9**9**9", "s" * 99, "("])
def test_what_measures_something_else_is_refused(unit):
    with pytest.raises(ValueError, match="expected one of rad/s, mrad/s, deg/s, rev/s, rpm"):
        find_unit(unit, "rad/s")


def test_angles_are_unwrapped_and_it_is_said(tmp_path):
    columns = swing()
    turns = 4.0 * columns["time"]
    wrapped = (turns + np.pi) % (2 * np.pi) - np.pi
    path = write(tmp_path / "log.csv", columns | {"angle": wrapped, "rate": 0 * turns + 4})
    data = read(path)
    np.testing.assert_allclose(data.trajectories[0].states[:, 0], turns, atol=1e-9)
    (finding,) = [f for f in data.findings if f.kind == "unwrapped"]
    assert finding.numbers["jumps"] == 6


def test_an_angle_that_turns_by_more_than_half_a_turn_follows_its_rate(tmp_path):
    columns = swing()
    times = columns["time"]
    speed = 1.3 * np.pi / (times[1] - times[0]) * np.sin(0.3 * times)
    angle = -1.3 * np.pi / (times[1] - times[0]) * np.cos(0.3 * times) / 0.3
    wrapped = (angle + np.pi) % (2 * np.pi) - np.pi
    path = write(tmp_path / "log.csv", columns | {"angle": wrapped, "rate": speed})
    found = read(path).trajectories[0].states[:, 0]
    np.testing.assert_allclose(found - found[0], angle - angle[0], atol=1e-6)


def test_trajectories_are_told_apart_by_columns(tmp_path):
    one = swing(20)
    columns = {name: np.tile(values, 3) for name, values in one.items()}
    columns["kind"] = np.repeat(["up", "down", "up"], 20)
    columns["trial"] = np.repeat([1.0, 1.0, 2.0], 20)
    path = write(tmp_path / "log.csv", columns)
    runs = read(path, trajectory=["kind", "trial"]).trajectories
    assert [run.name for run in runs] == ["log.csv up 1", "log.csv down 1", "log.csv up 2"]
    assert all(len(run) == 19 for run in runs)
    only = read(path, trajectory=["kind", "trial"], only={"kind": ["down"]}).trajectories
    assert [run.name for run in only] == ["log.csv down 1"]
    assert "no row holds sideways, the column has down, up" in error(
        path, trajectory=["kind"], only={"kind": ["sideways"]}
    )


def test_trajectories_are_split_at_time_resets_if_asked(tmp_path):
    columns = {name: np.tile(values, 2) for name, values in swing(20).items()}
    path = write(tmp_path / "log.csv", columns)
    assert len(read(path, split_at_time_resets=True).trajectories) == 2
    message = error(path)
    assert "row 22, column 'time': time goes backwards, from 0.95 s to 0 s" in message
    assert "split_at_time_resets: true" in message


def test_interleaved_trajectories_come_apart(tmp_path):
    columns = {name: np.repeat(values, 2) for name, values in swing(20).items()}
    columns["run"] = np.tile([0, 1], 20)
    data = read(write(tmp_path / "log.npz", columns), trajectory=["run"])
    assert [len(run) for run in data.trajectories] == [19, 19]
    assert "repeated" not in kinds(data)


def test_several_files_give_several_trajectories(tmp_path):
    paths = [write(tmp_path / name, swing()) for name in ("a.csv", "b.parquet", "c.npz")]
    data = read_logs(paths, STATES, ACTIONS)
    assert [run.name for run in data.trajectories] == ["a.csv", "b.parquet", "c.npz"]
    assert kinds(data) == ["sampling"] * 3


def test_matrices_in_npz_are_read_by_column(tmp_path):
    columns = swing()
    np.savez(
        tmp_path / "log.npz",
        time=columns["time"],
        x=np.column_stack([columns["angle"], columns["rate"]]),
        u=columns["voltage"][:, None],
    )
    settings = {"states": {"angle": "x.0", "rate": "x.1"}, "actions": {"voltage": "u.0"}}
    (run,) = read(tmp_path / "log.npz", **settings).trajectories
    np.testing.assert_array_equal(run.states[:, 1], columns["rate"])


def test_only_the_time_asked_for_is_used(csv):
    (run,) = read(csv(), start=2.0, stop=4.0).trajectories
    assert run.times[0] == pytest.approx(2.0) and run.times[-1] == pytest.approx(4.0)
    assert "Only 0 of 200 samples lie between start and stop." in error(csv(), start=1e3)


def test_unmeasured_channel_is_nan_and_reported(csv):
    data = read(csv(), states={"angle": "angle"})
    assert np.isnan(data.trajectories[0].states[:, 1]).all()
    assert "rate was not measured." in [finding.says for finding in data.findings]


def test_memory_channels_are_never_looked_for(csv):
    memory = Channel("voltage before", "V", "memory")
    (run,) = read(csv(), channels=((*STATES, memory), ACTIONS)).trajectories
    assert run.states.shape == (200, 3)
    assert np.isnan(run.states[:, 2]).all()


def test_missing_action_can_be_a_constant(csv):
    (run,) = read(csv(), actions={"voltage": Column(value=0.5)}).trajectories
    assert (run.actions == 0.5).all()


def test_text_files_of_many_makes(tmp_path):
    columns = swing(20)
    rows = list(zip(*columns.values(), strict=True))

    def check(text, **settings):
        path = tmp_path / "log.txt"
        path.write_bytes(text.encode())
        (run,) = read(path, **settings).trajectories
        np.testing.assert_array_equal(run.states[:, 0], columns["angle"])

    names = list(columns)
    for delimiter in (",", ";", "\t", "  ", " , "):
        check("\r\n".join(delimiter.join(map(str, row)) for row in [names, *rows]))
    check("\ufeff" + "\r".join(",".join(map(str, row)) for row in [names, *rows]))
    check("\n\n".join('"' + '","'.join(map(str, row)) + '"' for row in [names, *rows]))
    check("\n".join(";".join(map(str, r)).replace(".", ",") for r in [names, *rows]), decimal=",")
    preamble = "Motor 1; serial, number, 7\nat noon\n\n"
    check(preamble + "\n".join(",".join(map(str, row)) for row in [names, *rows]), skip=3)
    check("# made by us\n" + "\n".join(",".join(map(str, row)) + "," for row in [names, *rows]))
    check(
        "% x v\n" + "\n".join("  " + "   ".join(map(str, row)) for row in rows),
        header=False,
        comment="%",
        time=1,
        states={"angle": 2, "rate": 3},
        actions={"voltage": 4},
    )


def test_config_comes_from_yaml_and_command_line(tmp_path):
    (tmp_path / "columns.yaml").write_text(
        "time: {column: t, unit: ms}\nstates: {angle: {column: a, unit: deg}, rate: 3}\n"
        "actions: {voltage: u}\ntrajectory: [kind, 2]\nonly: {kind: [fall]}\n"
    )
    parser = jsonargparse.ArgumentParser()
    parser.add_class_arguments(LogFormat, "columns", sub_configs=True)
    given_ = ["--columns", str(tmp_path / "columns.yaml"), "--columns.stop", "3"]
    columns = parser.instantiate(parser.parse_args(given_)).columns
    assert columns == LogFormat(
        time=Column("t", "ms"),
        states={"angle": Column("a", "deg"), "rate": 3},
        actions={"voltage": "u"},
        trajectory=["kind", 2],
        only={"kind": ["fall"]},
        stop=3.0,
    )


def test_decimal_commas_are_read_where_they_cannot_be_thousands(csv):
    plain = read(csv(lambda lines: lines))
    comma = read(csv(lambda lines: [line.replace(",", ";").replace(".", ",") for line in lines]))
    assert np.array_equal(comma.trajectories[0].states, plain.trajectories[0].states)


@pytest.mark.parametrize("form", [
    "%Y-%m-%dT%H:%M:%S.%f", "%Y-%m-%d %H:%M:%S.%fZ", "%Y-%m-%dT%H:%M:%S.%f+02:00",
    "%d.%m.%Y %H:%M:%S.%f", "%H:%M:%S.%f",
])  # fmt: skip
def test_times_may_be_dates(tmp_path, form):
    columns = swing()
    begun = datetime.datetime(2026, 10, 25, 1, 59, 55)
    when = [begun + datetime.timedelta(seconds=float(t)) for t in columns["time"]]
    dated = columns | {"time": np.array([moment.strftime(form) for moment in when])}
    (run,) = read(write(tmp_path / "log.csv", dated)).trajectories
    assert np.allclose(np.diff(run.times), 0.05, atol=1e-6)
    assert len(run.times) == 200


@pytest.mark.parametrize("form", ["%Y-%m-%d", "%d.%m.%Y"])
def test_a_log_of_days_needs_no_time_of_day(tmp_path, form):
    columns = swing()
    begun = datetime.date(2026, 2, 20)
    days = [
        (begun + datetime.timedelta(days=k)).strftime(form) for k in range(len(columns["time"]))
    ]
    (run,) = read(write(tmp_path / "log.csv", columns | {"time": np.array(days)})).trajectories
    assert np.array_equal(np.diff(run.times), np.full(199, 86400.0))
