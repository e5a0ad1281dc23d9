"""Rows that hold the command that led to them are read so, and others as they are."""

from types import SimpleNamespace

import numpy as np
import pytest
from oven import GAIN, SLOW, Oven

from residual.gap import find_gap
from residual.gap.beside import Conventions
from residual.gap.log import Log
from residual.gap.readings import read as reading
from residual.gap.readings import row_late
from residual.trajectories import Trajectory
from sims.effects import ActuatorLag, Delay
from studies.gap.beforehand import seen_first

ROWS, HOLD, STEP = 400, 10, 5.0
#: What made up for rows that were read late, and what is there.
OFFERED = ("actuator_gain", "slow", "second_store", "delay", "actuator_lag")


def record(late, seed=0, weak=0.8, follows=0.0):
    """A heater in closed form that is too weak; its rows hold the command after them or, late,
    before. ``follows`` is what each row's duty takes over from the one before."""
    rng = np.random.default_rng(seed)
    duty = np.repeat(rng.uniform(0, 1, ROWS // HOLD), HOLD)
    for k in range(1, ROWS):
        duty[k] = follows * duty[k - 1] + (1 - follows) * duty[k]
    kept, path = np.exp(-STEP / SLOW), [20.0]
    for one in duty:
        path.append(kept * path[-1] + (1 - kept) * GAIN * weak * one)
    seen = (np.array(path) + rng.normal(0, 0.05, ROWS + 1))[:, None]
    duty = duty[:, None]
    if late:
        return Trajectory("run", STEP * np.arange(ROWS), seen[1:], duty[:-1])
    return Trajectory("run", STEP * np.arange(ROWS + 1), seen, duty)


def told(result):
    taken = "every row was taken to hold the input that led to it"
    return any(taken in one.says for one in result.quality)


@pytest.mark.parametrize("late", [True, False])
def test_a_weak_heater_is_all_that_is_named(late):
    """Read a row late, time constant and store made up for it, and were certain."""
    held = record(late, seed=1)
    result = find_gap(Oven(), [record(late)], held_out=[held], effects=OFFERED)
    assert told(result) == late
    (named,) = (v for v in result.verdicts if v.parameters)
    assert (named.kind, named.effect) == ("confirmed", "actuator_gain")
    assert named.parameters["gain"].value == pytest.approx(-0.2, abs=0.005)
    assert result.held_out.after.value < 1.2 * result.held_out.noise_floor.value


@pytest.mark.long
def test_another_time_constant_is_no_late_row():
    fast = record(late=False)
    result = find_gap(Oven(), [Trajectory("run", 2 * fast.times, fast.states, fast.actions)])
    assert not told(result) and result.conventions is None
    assert any(v.effect == "slow" for v in result.verdicts if v.kind == "confirmed")


def answers(monkeypatch, before, after, adequate=False, effects=()):
    """What is made of errors as the log is said to be and with inputs a row earlier."""
    model = SimpleNamespace(simulator=Oven(), added=lambda theta: effects)
    fit = SimpleNamespace(model=model, theta=np.zeros(0))
    searches = [SimpleNamespace(name=name, tried={(): fit}) for name in ("said", "earlier")]
    found, again = (
        SimpleNamespace(search=search, key=(), adequate=enough)
        for search, enough in zip(searches, (False, adequate), strict=True)
    )
    errors = {"said": before, "earlier": after}
    monkeypatch.setattr(reading, "forecast_error", lambda search, key: errors[search.name])
    monkeypatch.setattr(row_late, "error_of", lambda *given: after)
    monkeypatch.setattr(row_late, "prepare", lambda *given: "ready")
    runs = (record(True),)
    log = Log(Oven(), runs, runs, 1.0, by_user=False, apart=(), findings=[], left_out=[])
    read = row_late.Read(log, "as said", found)
    asked = reading.Asked(Oven(), lambda *given: again, lambda says: None)
    return row_late.a_row_earlier(read, asked)


def test_clearly_better_is_read_so_a_little_better_is_told_first_and_else_nothing(monkeypatch):
    assert answers(monkeypatch, 1.0, 0.3).says
    doubtful = answers(monkeypatch, 1.0, 0.5)
    assert not doubtful.says
    assert doubtful.conventions == Conventions(("duty",), pytest.approx(0.5**-0.5), "row")
    assert answers(monkeypatch, 1.0, 0.5, adequate=True).says
    for after in (0.6, 1.2):
        same = answers(monkeypatch, 1.0, after, adequate=True)
        assert same.conventions is None and not same.says and same.prepared == "as said"


@pytest.mark.parametrize("kind", [Delay, ActuatorLag])
def test_what_is_late_by_a_row_again_was_not_logged_a_row_late(monkeypatch, kind):
    """A filter in a sensor was a delay by a row and more, of inputs taken a row earlier."""
    assert not answers(monkeypatch, 1.0, 0.3, effects=[kind("duty", 1.4 * STEP)]).says
    assert answers(monkeypatch, 1.0, 0.3, effects=[kind("duty", 0.4 * STEP)]).says


def test_what_is_told_first_names_the_columns():
    row = Conventions(("duty",), 1.3, "row")
    told_first = seen_first(SimpleNamespace(conventions=row))
    assert "with duty a row earlier in the log, what is found errs 1.3 times less" in told_first
