"""Of sensors that are read less often than rows come, repeats are no readings."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from residual.gap import find_gap
from residual.gap.data.repeats import fresh, rhythm, without_repeats
from residual.trajectories import Trajectory
from sims.effects import CoulombFriction
from sims.pendulum_equation import PendulumEquation
from studies.hidden.data import Truth, make_logs

TIMES = np.arange(1200) * 0.01


def motion(seed):
    """A smooth motion that stands still in between."""
    rng = np.random.default_rng(seed)
    waves = sum(a * np.sin(w * TIMES + p) for a, w, p in rng.uniform(0.3, 2.0, (3, 3)))
    return np.where((TIMES > 4) & (TIMES < 5), waves[400], waves)


def repeated(values, rows):
    """Each reading until the next one, which come in these rows."""
    return values[rows[np.searchsorted(rows, np.arange(len(values)), side="right") - 1]]


@given(every=st.integers(2, 12), late=st.floats(0, 0.3), seed=st.integers(0, 99))
def test_readings_are_told_from_their_repeats(every, late, seed):
    rng = np.random.default_rng(seed)
    rows = np.arange(0, 1200, every)
    rows[1:] += (rng.random(len(rows) - 1) < late) & (every > 2)
    rows = rows[rows < 1200]
    seen = repeated(motion(seed) + rng.normal(0, 0.01, 1200), rows)
    assert rhythm([seen]) == every
    np.testing.assert_array_equal(np.flatnonzero(fresh(seen, every)), rows)


@given(step=st.floats(0.005, 0.2), speed=st.floats(0.1, 3.0), seed=st.integers(0, 99))
def test_an_encoder_that_turns_slowly_is_read_in_every_row(step, speed, seed):
    even = speed * TIMES + 0.02 * motion(seed)
    for moved in (even, motion(seed)):
        assert rhythm([np.round(moved / step) * step]) == 0


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_what_changes_in_every_row_or_hardly_ever_has_no_rhythm(noise):
    rng = np.random.default_rng(0)
    assert rhythm([motion(1) + noise * rng.standard_normal(1200)]) == 0
    assert rhythm([np.repeat(rng.uniform(0, 1, 12), 100)]) == 0
    assert rhythm([np.ones(1200)]) == 0 and rhythm([]) == 0


@pytest.mark.long
def test_a_slow_bus_hides_no_friction():
    """The pendulum's angle comes in every fourth row; all rows show stairs."""
    logs = make_logs(Truth(coulomb_friction=2e-4), 3, "strong", "A", runs=4)
    slow = []
    for run in logs:
        rows = np.arange(0, len(run.times), 4)
        angle = repeated(run.states[:, 0], rows)
        states = np.column_stack([angle, np.full(len(angle), np.nan)])
        slow.append(Trajectory(run.name, run.times, states, run.actions))
    runs, (finding,) = without_repeats(PendulumEquation(), slow)
    assert finding.where == "angle" and finding.kind == "repeats"
    np.testing.assert_array_equal(np.flatnonzero(np.isfinite(runs[0].states[:, 0]))[:3], [0, 4, 8])
    found = find_gap(PendulumEquation(), slow, effects=["mass", "coulomb_friction"], hold="zero")
    first = found.verdicts[0]
    assert (first.kind, first.effect) == ("confirmed", CoulombFriction.name)
    assert first.parameters["level"].value == pytest.approx(2e-4, rel=0.1)
