"""Step tests that were logged from the step on: what came before is in no log."""

import numpy as np
import pytest
from oven import LAG, Oven, steps

from residual.gap import find_gap
from residual.trajectories import Trajectory


def lag_of(found):
    """The lag that is certain, in s."""
    (verdict,) = [v for v in found.verdicts if v.kind == "confirmed"]
    assert verdict.effect == "actuator_lag"
    (effect,) = [e for e in found.effects if str(e).startswith("actuator_lag")]
    return effect.time_constant


def told(found):
    """Whether it is said that records are taken to begin from rest."""
    return [one.says for one in found.quality if "taken to be rest" in one.says]


OFFERED = ("actuator_lag", "delay", "actuator_gain", "slow")
TESTS = [steps(s, [duty], 0.0, hold=120) for s, duty in enumerate((0.4, 0.8, 0.6, 1.0))]


@pytest.mark.parametrize("turned", [pytest.param(False, marks=pytest.mark.long), True])
def test_a_lag_shows_in_step_tests_that_begin_with_the_step(turned):
    found = find_gap(Oven(), TESTS[::-1] if turned else TESTS, effects=OFFERED)
    assert lag_of(found) == pytest.approx(LAG, rel=0.05)
    assert told(found)
    assert found.gap.after.value < 0.1 * found.gap.before.value


def test_what_was_settled_at_its_first_input_stays_so():
    runs = [steps(s, [d, 1 - d / 2, 0.3], d) for s, d in enumerate((0.4, 0.8, 0.6, 1.0))]
    found = find_gap(Oven(), runs, effects=OFFERED)
    assert lag_of(found) == pytest.approx(LAG, rel=0.05)
    assert not told(found)


@pytest.mark.long
def test_records_of_both_kinds_are_told_apart():
    runs = [steps(s, [d, 1 - d / 2, 0.3], d * (s % 2)) for s, d in enumerate((0.4, 0.8, 0.6, 1.0))]
    found = find_gap(Oven(), runs, effects=OFFERED)
    assert lag_of(found) == pytest.approx(LAG, rel=0.05)
    (said,) = told(found)
    assert {"run 0", "run 2"} == {name for name in ("run 0", "run 1", "run 2") if name in said}


def test_without_a_lag_it_makes_no_difference_and_is_not_told():
    runs = [steps(s, [duty], 0.0, lag=0.0, hold=120) for s, duty in enumerate((0.4, 0.8, 0.6))]
    found = find_gap(Oven(), runs, effects=OFFERED)
    assert [v.kind for v in found.verdicts if v.kind != "needs_data"] == ["no_gap"]
    assert not told(found)


@pytest.mark.long
def test_it_is_asked_where_only_a_delay_is_offered():
    found = find_gap(Oven(), TESTS, effects=("delay", "actuator_gain", "constant_load", "slow"))
    assert told(found)
    assert "delay@duty" in [str(effect) for effect in found.effects]
    assert found.gap.after.value < 0.4 * found.gap.before.value


@pytest.mark.long
def test_records_set_aside_are_judged_likewise():
    found = find_gap(Oven(), TESTS[:3], held_out=TESTS[3:], effects=OFFERED)
    assert found.held_out.after.value < 0.1 * found.held_out.before.value


@pytest.mark.long
def test_a_record_set_aside_that_goes_on_is_not_taken_to_begin_from_rest():
    """As where a step test is cut in two: a lag has nothing to do in the second half."""
    ends = [Trajectory(f"end {i}", t.times[60:], t.states[60:], t.actions[60:]) for i, t in
            enumerate(TESTS)]  # fmt: skip
    found = find_gap(Oven(), TESTS, held_out=ends, effects=OFFERED)
    assert lag_of(found) == pytest.approx(LAG, rel=0.05)
    assert told(found)
    noise = found.held_out.noise_floor.value
    assert found.held_out.after.value < 1.5 * noise


def test_what_came_before_a_record_has_an_entry_for_each_input():
    one = TESTS[0]
    with pytest.raises(ValueError, match=r"run 0: before has shape \(2,\), expected \(1,\)"):
        Trajectory(one.name, one.times, one.states, one.actions, np.zeros(2))
    begun = Trajectory(one.name, one.times, one.states, one.actions, np.zeros(1))
    assert begun.piece(0, 9).before is begun.before
    assert begun.piece(1, 9).before is None
