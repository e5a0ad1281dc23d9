"""Records and columns that are copies of others are no second measurement."""

import dataclasses

import numpy as np
import pytest

from residual.gap import find_gap
from residual.gap.data.copies import shared
from residual.gap.data.same_columns import same_columns
from residual.trajectories import Trajectory
from sims.pendulum_equation import PendulumEquation
from studies.hidden.data import Truth, make_logs


@pytest.mark.parametrize("part", [slice(None), slice(21, 90)])
def test_a_record_set_aside_that_is_fitted_too_is_told(part):
    """As a whole, and in part, whatever its times count from."""
    logs = make_logs(Truth(), 4, "strong", "A", 5)
    times, states = logs[0].times[part], logs[0].states[part]
    actions = logs[0].actions[part][: len(times) - 1]
    copy = Trajectory("test.csv", times - times[0], states, actions)
    found = find_gap(PendulumEquation(), logs, held_out=[copy], effects=["mass"], minutes=0.2)
    assert any("test.csv" in one.where and "is no test" in one.says for one in found.quality)


def test_measured_again_under_the_same_commands_is_a_test():
    logs = make_logs(Truth(), 4, "strong", "A", 5)
    rng = np.random.default_rng(0)
    states = logs[0].states + 1e-3 * rng.standard_normal(logs[0].states.shape)
    assert not shared([dataclasses.replace(logs[0], states=states)], logs)
    assert not shared(logs[:1], logs[1:])
    short = [logs[0].piece(0, 25)]
    assert shared(short, short[:0]) == []
    assert shared([dataclasses.replace(short[0], name="again")], short)


def test_two_states_that_were_read_from_one_column_are_refused():
    (run,) = make_logs(Truth(), 4, "strong", "A", 1)
    both = dataclasses.replace(run, states=run.states[:, [0, 0]])
    with pytest.raises(ValueError, match=r"rate: reads the same as 'angle' in all 251 rows"):
        find_gap(PendulumEquation(), both)
    resting = dataclasses.replace(run, states=np.zeros_like(run.states))
    assert not same_columns(PendulumEquation(), [run, resting])
    assert not same_columns(PendulumEquation(), [resting])
