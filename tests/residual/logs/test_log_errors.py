"""Measured logs: what is broken gets one line that tells the fix."""

import numpy as np
import pyarrow
import pyarrow.parquet
import pytest
from swings import ACTIONS, STATES, error, read, swing, write

from residual.logs import Column, LogError, LogFormat, read_logs


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


def test_what_is_no_layout_and_channels_that_were_exchanged():
    with pytest.raises(LogError, match=r"columns is 'c.yaml', expected a LogFormat"):
        read_logs("log.csv", STATES, ACTIONS, "c.yaml")
    with pytest.raises(LogError, match=r"state channels: '\w+' is an input; expected the sim"):
        read_logs("log.csv", ACTIONS, STATES)


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


def test_a_last_row_that_is_no_sample_may_be_deleted(csv):
    message = error(csv(lambda lines: [*lines, "Total,,,"]))
    assert "found 'Total', expected a number" in message
    assert message.endswith("; if this row is no sample, delete it")


@pytest.mark.parametrize("cell", ["1,000.5", "1,000,000"])
def test_commas_between_thousands_are_to_be_left_out(csv, cell):
    def change(lines):
        return [*lines[:8], f'"{cell}",1,0,1', *lines[9:]]

    assert error(csv(change)).endswith("leave out the commas between thousands")


@pytest.mark.parametrize(("cell", "unit"), [("-100%", "%"), ("2.5 mV", "mV"), ("1e3°C", "°C")])
def test_a_unit_in_a_cell_belongs_elsewhere(csv, cell, unit):
    def change(lines):
        return [*lines[:8], f"0.35,{cell},0,1", *lines[9:]]

    message = error(csv(change))
    assert "row 9, column 'angle': found " in message
    assert message.endswith(f"leave {unit} out of the cells, and say `unit: {unit}` of the column")


def test_a_comma_that_may_part_thousands_is_asked_for(csv):
    def change(lines):
        return [lines[0].replace(",", ";"), *(f"{i};0.1;1;1,50{i % 10}" for i in range(200))]

    message = error(csv(change))
    assert "leave out the commas if they part thousands, set decimal: ','" in message


@pytest.mark.parametrize("word", ["inf", "-Infinity", "1e999"])
def test_infinite_value(csv, word):
    def change(lines):
        return [*lines[:8], f"0.35,{word},0,1", *lines[9:]]

    assert "row 9, column 'angle': found an infinite value" in error(csv(change))


def test_a_time_that_never_changes(tmp_path):
    path = write(tmp_path / "log.npz", swing() | {"time": np.full(200, 3.0)})
    assert "column 'time': time is 3 in every row, expected seconds that go on" in error(path)


def test_a_scale_that_makes_one_value_of_all(tmp_path):
    path = write(tmp_path / "log.npz", swing())
    for scale in (0.0, np.nan):
        with pytest.raises(LogError, match=r"state 'angle' has scale .*, expected a factor"):
            read(path, states={"angle": Column("angle", scale=scale)})


def test_column_without_any_value(tmp_path):
    path = write(tmp_path / "log.npz", swing() | {"rate": np.full(200, np.nan)})
    assert "column 'rate': no value at all for 'rate'" in error(path)


def test_a_state_that_one_of_several_files_lacks(tmp_path):
    """An empty column says that it was not measured there."""
    whole = write(tmp_path / "whole.csv", swing())
    empty = write(tmp_path / "empty.npz", swing() | {"rate": np.full(200, np.nan)})
    states = {"angle": "angle", "rate": "rate"}
    data = read_logs([whole, empty], STATES, ACTIONS, LogFormat(states=states))
    assert np.isnan(data.trajectories[1].states[:, 1]).all()
    columns = swing()
    del columns["rate"]
    lacking = write(tmp_path / "lacking.csv", columns)
    with pytest.raises(LogError, match=r"no column 'rate', .* give it an empty column of that"):
        read_logs([whole, lacking], STATES, ACTIONS, LogFormat(states=states))
    with pytest.raises(LogError, match="column 'rate': no value at all for 'rate' in any file"):
        read_logs([empty, empty], STATES, ACTIONS, LogFormat(states=states))


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
    assert (
        "no column 'volt' for 'voltage', the file has" in message
        and "did you mean 'volts'?" in message
    )
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
    # Nothing is offered that measures something else.
    assert "unit 'd/min' cannot be converted to rad/s: expected one of rad/s" in error(
        path, states={"rate": Column("rate", "d/min")}
    )
    assert "column 'angle': unit 'deg/s' cannot be converted to rad: expected one of rad" in error(
        path, states={"angle": Column("angle", "deg/s")}
    )
    assert "give time, states and actions by position" in error(path, header=False)
    assert "only an action can have a constant value" in error(
        path, states={"angle": Column(value=1.0)}
    )
    assert "delimiter 'ab' is not usable" in error(path, delimiter="ab")
    assert "decimal is 'x', expected '.' or ','" in error(path, decimal="x")
    assert "minimum_samples is 2, expected at least 3" in error(path, minimum_samples=2)


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


def test_an_input_that_never_changes_is_told(csv, tmp_path):
    path = csv(voltage=np.zeros(200))

    def told(data):
        return [finding.says for finding in data.findings if finding.kind == "constant"]

    (says,) = told(read(path))
    assert says.startswith("It is 0 V in all 199 samples: if it was not held there")
    assert not told(read(path, actions={"voltage": Column(value=0.0)}))
    # One free decay among runs with input is nothing to tell.
    other = write(tmp_path / "other.csv", swing())
    assert not told(read_logs([path, other], STATES, ACTIONS))
    assert len(read(path, channels=(STATES, ())).trajectories) == 1


@pytest.mark.parametrize("when", ["05/01/2026 12:00:00", "5-1-26 12:00", "2026/05/01"])
def test_a_date_that_may_be_read_two_ways_is_asked_for(csv, when):
    def change(lines):
        return [lines[0], *(",".join([when, *line.split(",")[1:]]) for line in lines[1:])]

    message = error(csv(change))
    assert f"found {when!r}" in message
    assert "write times in seconds, or as 2024-05-01 12:00:00.5" in message
