"""Measured logs: what is good is read exactly, what is broken gets one line that tells the fix."""

import dataclasses
import io
import os
from pathlib import Path

import jsonargparse
import numpy as np
import pyarrow
import pyarrow.parquet
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from residual.logs import Column, LogError, LogFormat, read_logs
from residual.logs.units import UNITS, find_unit
from sims.simulator import Channel

ROOT = Path(__file__).parents[2]
DATA = Path(os.environ.get("SIMGAP_DATA", ROOT.parent / "shared" / "data"))

STATES = (
    Channel("angle", "rad", "position", angle=True),
    Channel("rate", "rad/s", "rate", rate_of="angle", scale=10.0),
)
ACTIONS = (Channel("voltage", "V", "input", scale=3.0),)
DEG = 180 / np.pi


def swing(samples=200, dt=0.05, speed=2.0, size=1.2):
    """Columns of a log of an exact swing, in SI."""
    t = dt * np.arange(samples)
    return {
        "time": t,
        "angle": 0.3 + size * np.sin(speed * t),
        "rate": size * speed * np.cos(speed * t),
        "voltage": np.sign(np.sin(5.3 * t + 0.1)),
    }


def write(path, columns):
    if path.suffix == ".npz":
        np.savez(path, **columns)
    elif path.suffix == ".parquet":
        pyarrow.parquet.write_table(pyarrow.table(dict(columns)), path)
    else:
        rows = [",".join(columns)]
        rows += [",".join(map(str, row)) for row in zip(*columns.values(), strict=True)]
        path.write_text("\n".join(rows) + "\n")
    return path


def read(path, channels=(STATES, ACTIONS), **settings):
    return read_logs([path], *channels, LogFormat(**settings))


def error(path, **settings):
    """The message of the one error, which is one line."""
    with pytest.raises(LogError) as caught:
        read(path, **settings)
    message = str(caught.value)
    assert "\n" not in message and message.isprintable()
    return message


def kinds(data):
    return [finding.kind for finding in data.findings]


@pytest.fixture
def csv(tmp_path):
    """A function that writes a CSV of a swing whose lines it may change."""

    def make(change=lambda lines: lines, **columns):
        path = write(tmp_path / "log.csv", swing() | columns)
        path.write_text("\n".join(change(path.read_text().splitlines())) + "\n")
        return path

    return make


# What is good


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".npz"])
def test_every_format_is_read_exactly(tmp_path, suffix):
    columns = swing()
    data = read(write(tmp_path / f"log{suffix}", columns))
    (run,) = data.trajectories
    np.testing.assert_array_equal(run.times, columns["time"])
    np.testing.assert_array_equal(run.states, np.column_stack([columns["angle"], columns["rate"]]))
    np.testing.assert_array_equal(run.actions[:, 0], columns["voltage"][:-1])
    assert kinds(data) == ["sampling"]


@settings(max_examples=30, deadline=None)
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
    assert find_unit("degC", "K") == ("K", 1.0, 273.15)
    freezing = find_unit("degF", "K")
    assert freezing.factor * 32 + freezing.offset == pytest.approx(273.15)
    assert find_unit("rpm", "rad/s").factor * 60 == pytest.approx(2 * np.pi)
    assert find_unit("km/h", "m/s").factor * 36 == pytest.approx(10)
    assert find_unit("", "counts") == ("counts", 1.0, 0.0)
    for name, unit in UNITS.items():
        assert unit.base in UNITS and UNITS[unit.base].factor == 1, name


def test_angles_are_unwrapped_and_it_is_said(tmp_path):
    columns = swing()
    turns = 4.0 * columns["time"]
    wrapped = (turns + np.pi) % (2 * np.pi) - np.pi
    path = write(tmp_path / "log.csv", columns | {"angle": wrapped, "rate": 0 * turns + 4})
    data = read(path)
    np.testing.assert_allclose(data.trajectories[0].states[:, 0], turns, atol=1e-9)
    (finding,) = [f for f in data.findings if f.kind == "unwrapped"]
    assert finding.numbers["jumps"] == 6


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


# What is mended and reported


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


def test_repeated_times_are_dropped(csv):
    data = read(csv(lambda lines: [*lines[:10], lines[9], lines[9], *lines[10:]]))
    assert len(data.trajectories[0].times) == 200
    (finding,) = [finding for finding in data.findings if finding.kind == "repeated"]
    assert finding.says == ("2 samples repeat the time before them (first in row 11); dropped.")


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


# What is broken


def test_no_file_and_no_table(tmp_path):
    with pytest.raises(LogError, match="no log files"):
        read_logs([], STATES, ACTIONS)
    assert "there is no such file" in error(tmp_path / "none.csv")
    assert "this is not a file" in error(tmp_path)
    (tmp_path / "log.xlsx").write_text("x")
    assert "unknown kind of file '.xlsx', expected one of .csv" in error(tmp_path / "log.xlsx")
    for name in ("empty.csv", "empty.parquet", "empty.npz"):
        (tmp_path / name).write_bytes(b"")
        assert "the file is empty" in error(tmp_path / name)
    (tmp_path / "blank.csv").write_text("\n \n# only a comment\n")
    assert "no row holds data" in error(tmp_path / "blank.csv")
    for name in ("bad.parquet", "bad.npz"):
        (tmp_path / name).write_bytes(b"PK or PAR1, but not really")
        assert "cannot be read as" in error(tmp_path / name)


def test_header_missing_or_alone(csv):
    message = error(csv(lambda lines: ["", *lines[1:]]))
    assert "row 2: holds only numbers" in message and "set header: false" in message
    assert "only the header is there" in error(csv(lambda lines: lines[:1]))


def test_text_in_a_number_is_found_in_its_row(csv):
    def change(lines):
        lines[41] = "oops".join(lines[41].rsplit("-1.0", 1))
        return ["# comment", "", *lines[:1], "", *lines[1:]]

    path = csv(change, voltage=-np.arange(200) % 2 * 1.0 - 1)
    row = 1 + path.read_text().splitlines().index(
        next(line for line in path.read_text().splitlines() if "oops" in line)
    )
    message = error(path)
    assert message.startswith(f"{path}, row {row}, column 'voltage': found 'oops', expected a num")


def test_decimal_comma_is_recognised(csv):
    path = csv(lambda lines: [line.replace(",", ";").replace(".", ",") for line in lines])
    assert "set decimal: ','" in error(path)


@pytest.mark.parametrize("word", ["inf", "-Infinity", "1e999"])
def test_infinite_value(csv, word):
    def change(lines):
        return [*lines[:8], f"0.35,{word},0,1", *lines[9:]]

    assert "row 9, column 'angle': found an infinite value" in error(csv(change))


def test_column_without_any_value(tmp_path):
    path = write(tmp_path / "log.npz", swing() | {"rate": np.full(200, np.nan)})
    assert "column 'rate': no value at all for 'rate'" in error(path)


def test_time_going_backwards(csv):
    message = error(csv(lambda lines: [*lines[:20], lines[5], *lines[20:]]))
    assert "row 21, column 'time': time goes backwards, from 0.9 s to 0.2 s" in message


def test_trajectory_of_two_rows(csv):
    message = error(csv(lambda lines: lines[:3]))
    assert "row 2: a trajectory of 2 samples ('log.csv'), expected at least 5" in message


def test_missing_columns_are_named_with_what_is_there(csv):
    path = csv(lambda lines: ["t,theta,rate,volts", *lines[1:]])
    message = error(path)
    assert "no column for action 'voltage', the file has 't', 'theta', 'rate', 'volts'" in message
    message = error(path, actions={"voltage": "volt"}, time="t")
    assert "no column 'volt', the file has" in message and "did you mean 'volts'?" in message
    path = csv(lambda lines: ["time,x,y,voltage", *lines[1:]])
    assert "no column is named like a state of the simulator ('angle', 'rate')" in error(path)


def test_layout_that_fits_no_file(csv):
    path = csv()
    message = error(path, states={"angel": "angle"})
    assert "the simulator has no state channel 'angel'" in message
    assert "did you mean 'angle'?" in message
    assert "unknown unit 'degr': did you mean 'deg'?" in error(
        path, states={"angle": Column("angle", "degr")}
    )
    assert "column 'angle': unit 'deg/s' is converted to rad/s, but rad is needed" in error(
        path, states={"angle": Column("angle", "deg/s")}
    )
    assert "give time, states and actions by position" in error(path, header=False)
    assert "only an action can have a constant value" in error(
        path, states={"angle": Column(value=1.0)}
    )
    assert "delimiter 'ab' is not usable" in error(path, delimiter="ab")
    assert "expected '.' or ','" in error(path, decimal="x")


def test_uneven_rows(csv):
    message = error(csv(lambda lines: [*lines[:8], "0.35,1", *lines[9:]]))
    assert "row 9: 2 fields, expected 4 as in row 1" in message
    message = error(csv(lambda lines: [*lines[:8], lines[8] + ",7", *lines[9:]]))
    assert "row 9: 5 fields, expected 4" in message
    message = error(csv(lambda lines: [*lines[:8], '"' + lines[8], *lines[9:]]))
    assert "row 9: cannot be split into fields" in message


def test_undecodable_and_binary_text(tmp_path):
    path = tmp_path / "log.csv"
    path.write_bytes(b"time,angle\n0,1\n0.1,\xb0\n")
    assert "row 3: byte 0xb0 is not UTF-8 text; save the file as UTF-8" in error(path)
    path.write_bytes(b"time,angle\n0,\x00\n")
    assert "row 2: holds zero bytes" in error(path)


def test_names_that_occur_twice(csv):
    path = csv(lambda lines: ["time,angle,angle,voltage", *lines[1:]])
    assert "column 'angle': 2 columns have this name" in error(path)
    path = csv(lambda lines: [f"{lines[0]},x,x", *(f"{line},0,0" for line in lines[1:])])
    assert len(read(path).trajectories) == 1
    table = pyarrow.Table.from_arrays([pyarrow.array([1.0, 2.0])] * 2, names=["time", "time"])
    pyarrow.parquet.write_table(table, path.with_suffix(".parquet"))
    settings = {"states": {"angle": "time"}, "actions": {"voltage": Column(value=0.0)}}
    assert "2 columns have this name" in error(path.with_suffix(".parquet"), **settings)


def test_arrays_of_different_length(tmp_path):
    path = write(tmp_path / "log.npz", swing() | {"angle": np.zeros(150)})
    assert "columns of different length (time: 200, angle: 150" in error(path)


def test_pickled_arrays_are_not_loaded(tmp_path):
    path = write(tmp_path / "log.npz", swing() | {"angle": np.array([print] * 200, object)})
    assert "cannot be read as NPZ" in error(path)


def test_constant_action(csv, tmp_path):
    path = csv(voltage=np.zeros(200))
    message = error(path)
    assert "column 'voltage': the action 'voltage' is 0 V in all 199 samples" in message
    assert "allow_constant_action: true" in message
    assert len(read(path, allow_constant_action=True).trajectories) == 1
    # One free decay among runs with input is no reason to stop.
    other = write(tmp_path / "other.csv", swing())
    assert len(read_logs([path, other], STATES, ACTIONS).trajectories) == 2
    assert len(read(path, channels=(STATES, ())).trajectories) == 1


# Units that are wrong by 57.3


@pytest.mark.parametrize("noise", [0.0, 1.0])
@pytest.mark.parametrize("wrap", [False, True])
@pytest.mark.parametrize("speed", [2.0, 8.0])
def test_wrong_units_are_found_by_kinematics(csv, noise, wrap, speed):
    rng = np.random.default_rng(1)
    clean = swing(speed=speed)
    angle = clean["angle"] + 0.01 * noise * rng.standard_normal(200)
    rate = clean["rate"] + 0.2 * noise * rng.standard_normal(200)
    if wrap:
        angle = (angle + 2.0 + np.pi) % (2 * np.pi) - np.pi
    assert "kinematics" not in kinds(read(csv(angle=angle, rate=rate)))
    degrees = error(csv(angle=DEG * angle, rate=rate))
    assert "column 'angle'" in degrees and "looks like degrees" in degrees
    assert "set unit: deg" in degrees
    assert "'rate' looks like degrees per second" in error(csv(angle=angle, rate=DEG * rate))
    assert "set scale: -1" in error(csv(angle=angle, rate=-rate))
    # Stated as degrees, but it was radians.
    declared = {"angle": Column("angle", "deg"), "rate": "rate"}
    assert "set unit: rad" in error(csv(angle=angle, rate=rate), states=declared)


def test_scale_of_a_sensor_that_no_unit_explains_is_a_finding(csv):
    data = read(csv(rate=swing()["rate"] / 1.3))
    (finding,) = [finding for finding in data.findings if finding.kind == "kinematics"]
    assert finding.numbers["scale"] == pytest.approx(1.3, abs=0.02)


def test_rate_unrelated_to_its_position_is_a_finding(csv):
    (finding,) = [f for f in read(csv(rate=np.sin(swing()["time"]))).findings[:1]]
    assert finding.kind == "kinematics" and "or the wrong columns" in finding.says


def test_noise_alone_is_no_finding_about_kinematics(csv):
    rng = np.random.default_rng(3)
    for _ in range(20):
        angle = 0.01 * rng.standard_normal(200)
        rate = 0.2 * rng.standard_normal(200)
        assert "kinematics" not in kinds(read(csv(angle=angle, rate=rate)))


def test_one_file_in_degrees_among_many_is_found(tmp_path):
    good = [write(tmp_path / f"{n}.csv", swing()) for n in range(5)]
    columns = swing()
    bad = write(tmp_path / "bad.csv", columns | {"angle": DEG * columns["angle"]})
    with pytest.raises(LogError, match=r"bad\.csv, column 'angle'|bad\.csv: column 'angle'"):
        read_logs([*good, bad], STATES, ACTIONS)


def test_degrees_without_a_measured_rate_are_found_by_plausibility(csv):
    clean = swing(speed=6.0)
    message = error(csv(angle=DEG * clean["angle"]), states={"angle": "angle"})
    assert "looks like degrees: set unit: deg (or unit: rad if that is right)" in message
    both = error(csv(angle=DEG * clean["angle"], rate=DEG * clean["rate"]))
    assert "looks like degrees" in both
    compass = (DEG * 1.5 * clean["time"]) % 360
    assert "jumps by about 360" in error(csv(angle=compass), states={"angle": "angle"})


def test_stating_the_unit_settles_the_matter(csv):
    fast = {"angle": 250 * swing()["time"], "rate": np.full(200, 250.0)}
    assert "set unit: deg" in error(csv(**fast))
    stated = {"angle": Column("angle", "rad"), "rate": Column("rate", "rad/s")}
    assert len(read(csv(**fast), states=stated).trajectories) == 1


# Anything at all


def only_log_errors(path, data, **settings):
    path.write_bytes(data)
    try:
        read(path, **settings)
    except LogError as error:
        assert "\n" not in str(error)


def seeds():
    """A good log in each format, as bytes."""
    columns = {name: np.round(values, 3) for name, values in swing(12).items()}
    text = "\n".join(
        [",".join(columns), *(",".join(map(str, r)) for r in zip(*columns.values(), strict=True))]
    )
    npz, parquet = io.BytesIO(), io.BytesIO()
    np.savez(npz, **columns)
    pyarrow.parquet.write_table(pyarrow.table(columns), parquet)
    return {".csv": text.encode(), ".npz": npz.getvalue(), ".parquet": parquet.getvalue()}


SEEDS = seeds()
ANY = settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("suffix", SEEDS)
@ANY
@given(data=st.data())
def test_mutated_files_never_give_another_error(tmp_path, suffix, data):
    content = bytearray(SEEDS[suffix])
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, len(content) - 1))
        junk = data.draw(st.binary(max_size=8))
        content[place : place + data.draw(st.integers(0, 20))] = junk
        content = content or bytearray(b"x")
    only_log_errors(tmp_path / f"log{suffix}", bytes(content))


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("suffix", SEEDS)
@ANY
@given(content=st.binary(max_size=300))
def test_random_bytes_never_give_another_error(tmp_path, suffix, content):
    only_log_errors(tmp_path / f"log{suffix}", content)


CELLS = st.one_of(
    st.floats(width=64).map(str),
    st.integers(-(10**20), 10**20).map(str),
    st.sampled_from(["", "nan", "inf", "1_0", "1e308", "-1e-320", "0", "1", "2", "٣", '"', "a b"]),
    st.text(max_size=5),
)


@ANY
@given(
    rows=st.lists(st.lists(CELLS, min_size=3, max_size=5), max_size=12),
    header=st.booleans(),
    delimiter=st.sampled_from(["auto", ",", ";", "tab", "blank"]),
    split=st.booleans(),
)
def test_random_tables_never_give_another_error(tmp_path, rows, header, delimiter, split):
    joiner = {"auto": ",", "tab": "\t", "blank": " "}.get(delimiter, delimiter)
    text = "\n".join(joiner.join(row) for row in [["time", "angle", "rate", "voltage"], *rows])
    layout = LogFormat(
        time=1,
        states={"angle": 2, "rate": 3},
        actions={"voltage": Column(value=1.0)},
        header=header,
        delimiter=delimiter,
        split_at_time_resets=split,
        minimum_samples=3,
    )
    only_log_errors(
        tmp_path / "log.csv",
        text.encode("utf-8", "surrogatepass"),
        **{field.name: getattr(layout, field.name) for field in dataclasses.fields(layout)},
    )


@ANY
@given(
    columns=st.fixed_dictionaries(
        {
            name: st.lists(st.floats(allow_nan=True, allow_infinity=name == "rate", width=64),
                           min_size=8, max_size=8)
            for name in ("time", "angle", "rate", "voltage")
        }
    ),
    ordered=st.booleans(),
)  # fmt: skip
def test_random_numbers_give_sound_trajectories_or_an_error(tmp_path, columns, ordered):
    arrays = {name: np.array(values) for name, values in columns.items()}
    if ordered:
        arrays["time"] = np.sort(arrays["time"])
    path = write(tmp_path / "log.npz", arrays)
    try:
        data = read(path, split_at_time_resets=True, minimum_samples=3)
    except LogError as error:
        assert "\n" not in str(error)
        return
    for run in data.trajectories:
        assert (run.durations > 0).all()
        assert np.isfinite(run.actions).all()
        assert not np.isinf(run.states).any()
        assert len(run.times) == len(run.states) == len(run.actions) + 1 >= 3


# The published logs

PENDULUM = (
    STATES,
    (Channel("torque", "N m", "input"),),
)


def drives(names):
    rates = (Channel(f"rate {n}", "rad/s", "rate", rate_of=f"angle {n}") for n in names)
    angles = (Channel(f"angle {n}", "rad", "position", angle=True) for n in names)
    return (*angles, *rates), tuple(Channel(f"torque {n}", "N m", "input") for n in names)


PUBLISHED = {
    "airtrack": (
        ["airtrack/real_linear_h_1.txt"],
        (
            Channel("position", "m", "position"),
            Channel("velocity", "m/s", "rate", rate_of="position"),
        ),
        (),
    ),
    "heater": (
        ["heater/data_step_test.csv"],
        (Channel("temperature", "K", "other"),),
        (Channel("level", "1", "input"),),
    ),
    "phone_drop": (
        ["phone-drop/phone_drop.csv"],
        (Channel("velocity", "m/s", "other"), Channel("acceleration", "m/s2", "other")),
        (),
    ),
    "pendulum_pair": (["pendulum-pair/run_b.csv"], *PENDULUM),
    "pendulum_swingup": (
        ["pendulum-swingup/run_ddp.csv", "pendulum-swingup/run_dircol.csv"],
        *PENDULUM,
    ),
    "arm_three_axes": (["arm-three-axes/run.csv"], *drives("146")),
    "arm_open_loop_torque": (["arm-open-loop-torque/run02.csv"], *drives("156")),
    "small_car_steps": (
        ["small-car-steps/run10.csv", "small-car-steps/run34.csv"],
        tuple(
            Channel(n, u, "other", angle=n == "heading")
            for n, u in {"x": "m", "y": "m", "heading": "rad", "speed": "m/s"}.items()
        ),
        (Channel("steering", "rad", "input"), Channel("speed_command", "m/s", "input")),
    ),
}
# Runs, samples, seconds of the first run, its first value of the last state channel.
FACTS = {
    "airtrack": (1, 434, 14.453, 37.178),
    "heater": (1, 401, 401.49, 299.53),
    "phone_drop": (38, 4994, 0.578918, -0.105576),
    "pendulum_pair": (1, 1100, 5.495386, -0.142857),
    "pendulum_swingup": (2, 4170, 5.99916, 0.120879),
    "arm_three_axes": (1, 2201, 4.4, np.nan),
    "arm_open_loop_torque": (1, 1087, 4.344, 0.20),
    "small_car_steps": (2, 242, 3.0, 0.386),
}


@pytest.mark.parametrize("name", PUBLISHED)
def test_published_logs_are_read_by_their_configs(name):
    if not DATA.is_dir():
        pytest.skip(f"no published logs in {DATA}; set SIMGAP_DATA")
    files, states, actions = PUBLISHED[name]
    parser = jsonargparse.ArgumentParser()
    parser.add_class_arguments(LogFormat, "columns", sub_configs=True)
    config = ROOT / "studies" / "configs" / "logs" / f"{name}.yaml"
    layout = parser.instantiate(parser.parse_args(["--columns", str(config)])).columns
    data = read_logs([DATA / file for file in files], states, actions, layout)
    runs, samples, seconds, first = FACTS[name]
    assert len(data.trajectories) == runs
    assert sum(len(run.times) for run in data.trajectories) == samples
    assert np.ptp(data.trajectories[0].times) == pytest.approx(seconds, abs=1e-4)
    assert data.trajectories[0].states[0, -1] == pytest.approx(first, abs=1e-3, nan_ok=True)
    assert "kinematics" not in kinds(data)
