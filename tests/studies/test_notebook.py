"""What find_gap answers shows itself: as text, table, picture and page; effects go by name."""

import numpy as np
import pytest

import simgap
from residual import gap
from sims.pendulum_equation import PendulumEquation


def runs():
    rng = np.random.default_rng(0)
    true, times = PendulumEquation(0.09), 0.05 * np.arange(121)
    found = []
    for k in range(3):
        volts = np.repeat(rng.uniform(-3, 3, 20), 6)[:, None]
        states = true.rollout(np.array([np.pi, 0.0]), volts)
        seen = states + rng.normal(0, [2e-3, 2e-2], states.shape)
        found.append(simgap.Trajectory(f"run {k}", times, seen, volts))
    return found


@pytest.fixture(scope="module")
def found():
    return simgap.find_gap(
        PendulumEquation(), runs(), effects=["mass", "viscous_friction@pivot"], minutes=0.5
    )


def test_effects_go_by_name_as_on_the_command_line(found):
    assert [str(effect) for effect in found.effects] == ["mass"]
    tried = {label for rival in found.evidence for label in rival.effects}
    assert tried <= {"mass", "viscous_friction@pivot"}
    with pytest.raises(ValueError, match="no effect 'masss'"):
        gap.find_gap(PendulumEquation(), runs(), effects=["masss"])


def test_a_notebook_shows_the_answer_short_and_as_a_table(found):
    assert repr(found).count("\n") < 2 and len(repr(found)) <= 200
    assert repr(found.verdicts[0]).count("\n") < 2 and "mass" in repr(found)
    page = found._repr_html_()
    assert "<table" in page and "of the gap is mass" in page
    assert "CONFIRMED" in str(found)


def test_the_answer_is_a_table_a_picture_and_a_page(found, tmp_path):
    table = found.to_dataframe()
    (row,) = table[table["effect"] == "mass"].to_dict("records")
    assert row["low"] <= 0.035 <= row["high"] and row["unit"] == "kg"
    assert found.plot().axes
    path = found.report(tmp_path / "mine.html")
    assert path == tmp_path / "mine.html" and "Evidence and runners-up" in path.read_text()


def test_progress_is_shown_unless_it_is_told_to_somebody(capfd):
    told = []
    simgap.find_gap(PendulumEquation(), runs(), effects=["mass"], progress=told.append)
    assert told and "find_gap" not in capfd.readouterr().err
    simgap.find_gap(PendulumEquation(), runs(), effects=["mass"])
    assert "find_gap" in capfd.readouterr().err


def test_what_is_no_simulator_is_told_before_there_is_a_budget():
    with pytest.raises(ValueError, match="expected a Simulator"):
        simgap.find_gap(object(), [])
