"""A column map that names a column and leaves the unit to its header."""

import pytest

from residual.logs import LogFormat, read_logs
from residual.logs.layout import Column
from sims.simulator import Channel

STATES, ACTIONS = (Channel("x", "m", "position"),), (Channel("u", "V", "input"),)


def told(tmp_path, time, state, unit=""):
    rows = "\n".join(f"{0.1 * i:g},{i % 7},{i % 3}" for i in range(50))
    (tmp_path / "log.csv").write_text(f"{time},{state},u\n{rows}\n")
    columns = LogFormat(time=time, states={"x": Column(state, unit)})
    data = read_logs(tmp_path / "log.csv", STATES, ACTIONS, columns)
    return data, [finding for finding in data.findings if finding.kind == "unit"]


@pytest.mark.parametrize("time", ["t_min", "minutes", "Time (min)"])
def test_a_unit_that_the_map_leaves_out_is_told(tmp_path, time):
    data, (state, clock) = told(tmp_path, time, "x [cm]")
    assert "unit: cm" in state.says
    assert "unit: min" in clock.says
    assert {state.severity, clock.severity} == {"warning"}
    # What the map says is what is done.
    assert data.trajectories[0].states[1, 0] == 1.0
    assert data.trajectories[0].times[1] == pytest.approx(0.1)


@pytest.mark.parametrize("time", ["t", "t [s]", "minimum", "seconds"])
def test_what_is_settled_or_has_no_unit_is_no_matter(tmp_path, time):
    assert told(tmp_path, time, "x [m]")[1] == []
    assert told(tmp_path, time, "x [cm]", "cm")[1] == []
    assert told(tmp_path, time, "x [the first]")[1] == []
