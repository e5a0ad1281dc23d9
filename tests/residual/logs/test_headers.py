"""Columns that are named like channels, with their units in the header."""

import numpy as np
import pytest
from swings import error, kinds, read, swing, write


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
    (["angle [V]"], "'V' is converted to V, but rad is needed"),
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
