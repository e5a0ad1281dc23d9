"""Columns that are named like channels, with their units in the header."""

import numpy as np
import pytest
from swings import error, kinds, read, swing, write

from sims.simulator import Channel


@pytest.mark.parametrize("header", ["angle [deg]", "angle (°)", "angle[degrees] "])
def test_a_unit_in_the_header_is_converted_and_told(tmp_path, header):
    columns = swing()
    logged = {
        "time [ms]": 1000 * columns["time"], header: np.degrees(columns["angle"]),
        "rate (rad/s)": columns["rate"], "voltage": columns["voltage"],
    }  # fmt: skip
    data = read(write(tmp_path / "log.csv", logged))
    (run,) = data.trajectories
    np.testing.assert_allclose(run.times, columns["time"], atol=1e-9)
    np.testing.assert_allclose(run.states[:, 0], columns["angle"], atol=1e-9)
    np.testing.assert_array_equal(run.states[:, 1], columns["rate"])
    told = [finding.says for finding in data.findings if finding.kind == "unit"]
    assert len(told) == 2  # of the time and the angle; the rate is as it was
    assert any("angle" in says for says in told)


def test_a_column_of_exactly_that_name_comes_first(tmp_path):
    columns = swing()
    logged = {**columns, "angle [deg]": 0 * columns["angle"]}
    data = read(write(tmp_path / "log.csv", logged))
    np.testing.assert_array_equal(data.trajectories[0].states[:, 0], columns["angle"])
    assert "unit" not in kinds(data)


@pytest.mark.parametrize(("headers", "says"), [
    (["angle [V]"], "'V' cannot be converted to rad"),
    (["angle (filtered)"], "unknown unit 'filtered'"),
    (["angle [deg]", "angle [rad]"], "both named like 'angle'"),
])  # fmt: skip
def test_a_header_that_does_not_fit_is_refused_and_not_taken_for_unmeasured(
    tmp_path, headers, says
):
    columns = swing()
    logged = {name: columns[name] for name in ("time", "rate", "voltage")}
    logged |= dict.fromkeys(headers, columns["angle"])
    message = error(write(tmp_path / "log.csv", logged))
    assert says in message
    assert "--columns" in message


def test_capitals_in_a_header_do_not_matter_and_are_told(tmp_path):
    columns = swing()
    logged = {
        "Time (ms)": 1000 * columns["time"], "Angle [deg]": np.degrees(columns["angle"]),
        "RATE": columns["rate"], "Voltage": columns["voltage"],
    }  # fmt: skip
    data = read(write(tmp_path / "log.csv", logged))
    (run,) = data.trajectories
    np.testing.assert_allclose(run.times, columns["time"], atol=1e-9)
    np.testing.assert_allclose(run.states, np.stack([columns["angle"], columns["rate"]], 1))
    np.testing.assert_array_equal(run.actions[:, 0], columns["voltage"][:-1])
    assert "Column 'Voltage' was taken for 'voltage'." in [one.says for one in data.findings]


def test_a_column_that_is_another_channel_is_not_taken_for_one_in_capitals(tmp_path):
    channels = ((Channel("x", "m", "position"), Channel("X", "m", "position")), ())
    columns = {"time": 0.1 * np.arange(50), "x": np.sin(np.arange(50))}
    (run,) = read(write(tmp_path / "log.csv", columns), channels).trajectories
    np.testing.assert_allclose(run.states[:, 0], columns["x"])
    assert np.isnan(run.states[:, 1]).all()


def test_two_columns_that_differ_in_capitals_alone_are_asked_for(tmp_path):
    columns = swing()
    logged = {name: columns[name] for name in ("time", "rate", "voltage")}
    logged |= {"Angle [rad]": columns["angle"], "ANGLE (deg)": columns["angle"]}
    assert "both named like 'angle'" in error(write(tmp_path / "log.csv", logged))


def test_a_log_without_times_is_told_what_to_say(tmp_path):
    columns = swing()
    del columns["time"]
    message = error(write(tmp_path / "log.csv", columns))
    assert "no column 'time'" in message
    assert "time: {column: NAME, unit: s}" in message
    assert "period: 0.01" in message


@pytest.mark.parametrize(("unit", "header", "factor", "zero"), [
    ("kPa", "pressure [bar]", 0.01, 0.0), ("kPa", "pressure (Pa)", 1000.0, 0.0),
    ("degC", "pressure [K]", 1.0, 273.15), ("degC", "pressure [degF]", 1.8, 32.0),
    ("%", "pressure [1]", 0.01, 0.0),
])  # fmt: skip
def test_a_channel_may_count_in_another_unit_than_that_of_the_table(
    tmp_path, unit, header, factor, zero
):
    """As the temperatures of a tutorial do."""
    values = 20 + np.sin(0.1 * np.arange(50))
    channels = ((Channel("pressure", unit, "other"),), ())
    logged = {"time": 0.1 * np.arange(50), header: factor * values + zero}
    (run,) = read(write(tmp_path / "log.csv", logged), channels).trajectories
    np.testing.assert_allclose(run.states[:, 0], values, rtol=1e-12)


@pytest.mark.parametrize("delimiter", [",", " ", "\t"])
def test_names_in_the_comment_that_numpy_writes_are_the_header(tmp_path, delimiter):
    columns = swing()
    path = tmp_path / "log.txt"
    rows = np.stack(list(columns.values()), axis=1)
    header = "made by a rig, at noon\n" + delimiter.join(columns)
    np.savetxt(path, rows, header=header, delimiter=delimiter, fmt="%.17g")
    (run,) = read(path).trajectories
    np.testing.assert_array_equal(run.states[:, 0], columns["angle"])
    np.testing.assert_array_equal(run.states[:, 1], columns["rate"])
    assert len(run.times) == len(rows)


@pytest.mark.parametrize("above", [
    "# made by a rig", "# time,angle,rate", "# 1,2,3,4", "# time,angle,rate,voltage\n0,0,0,0\n#",
])  # fmt: skip
def test_a_comment_that_does_not_name_every_column_is_no_header(tmp_path, above):
    path = tmp_path / "log.csv"
    np.savetxt(path, np.stack(list(swing().values()), axis=1), delimiter=",")
    path.write_text(f"{above}\n{path.read_text()}")
    if above.endswith("#"):  # Above the first row of numbers it does; a later comment is none.
        assert len(read(path).trajectories) == 1
    else:
        assert "holds only numbers" in error(path)


def test_a_column_named_nearly_as_a_state_is_told_and_not_read(tmp_path):
    columns = swing()
    logged = {"angel" if name == "angle" else name: values for name, values in columns.items()}
    data = read(write(tmp_path / "log.csv", logged))
    (told,) = [finding for finding in data.findings if finding.kind == "misspelt"]
    assert told.where == "angle" and "'angel', which is not read" in told.says
    assert np.isnan(data.trajectories[0].states[:, 0]).all()
    # Whoever says which column is which leaves the others out on purpose.
    given = read(tmp_path / "log.csv", states={"rate": "rate"})
    assert "misspelt" not in kinds(given)
    assert "misspelt" not in kinds(read(write(tmp_path / "other.csv", columns)))
