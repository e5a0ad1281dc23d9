"""Rows that arrive in bursts are one reading, and said to be so."""

import numpy as np
import pytest

from residual.gap import find_gap
from residual.gap.data.bursts import without_bursts
from residual.trajectories import Trajectory
from sims.pendulum_equation import PendulumEquation

EVERY, ROWS = 0.1, 7


def swinging(bursts=60, inside=3e-4):
    """A pendulum let go, read by a port that is emptied ten times a second."""
    simulator = PendulumEquation()
    substeps = round(EVERY / simulator.dt)
    path = simulator.rollout([2.5, 0.0], np.zeros((bursts * substeps, 1)))[::substeps]
    times = EVERY * np.arange(bursts + 1)
    late = np.arange(ROWS) * inside
    states = np.repeat(path, ROWS, axis=0)
    states[:, 0] += 1e-3 * np.random.default_rng(0).standard_normal(len(states))
    states[:, 1] = np.nan
    when = (times[:, None] + late).ravel()
    return Trajectory("run", when, states, np.zeros((len(when) - 1, 1)))


def test_the_last_row_of_every_burst_is_taken():
    run = swinging()
    (kept,), (said,) = without_bursts([run])
    assert kept.times.tolist() == run.times[ROWS - 1 :: ROWS].tolist()
    assert kept.states[:, 0].tolist() == run.states[ROWS - 1 :: ROWS, 0].tolist()
    assert len(kept.actions) == len(kept.times) - 1
    assert said.kind == "bursts" and said.severity == "warning"
    assert said.numbers["every_s"] == pytest.approx(EVERY, rel=0.05)


@pytest.mark.parametrize("inside", [EVERY / ROWS, 0.02 * EVERY])
def test_even_rows_and_records_with_pauses_stay(inside):
    """Seven rows over more than a tenth of the time between are a record of their own."""
    run = swinging(inside=inside)
    kept, said = without_bursts([run])
    assert not said and kept == [run]


def test_a_logger_that_is_slow_at_rest_stays():
    """A cycler writes every 10 s at rest, and ten times a second in its few pulses."""
    times = np.concatenate(
        [1000.0 * k + np.concatenate([10.0 * np.arange(80), 800 + 0.1 * np.arange(400)])
         for k in range(3)]
    )  # fmt: skip
    pulse = (times % 1000.0) > 799
    states = np.where(pulse, 3.9, 4.1)[:, None] + 1e-4 * np.sin(times)[:, None]
    run = Trajectory("cell", times, states, pulse[:-1, None].astype(float))
    kept, said = without_bursts([run])
    assert not said and kept == [run]


def test_brief_records_between_long_rests_stay():
    """The fast part of every step alone: within it the state moves as far as ever."""
    rise = 1 - np.exp(-np.arange(40) / 8.0)
    times = np.concatenate([10.0 * n + 1e-3 * np.arange(40) for n in range(12)])
    states = np.tile(rise, 12)[:, None]
    run = Trajectory("run", times, states, np.zeros((len(times) - 1, 0)))
    kept, said = without_bursts([run])
    assert not said and kept == [run]


@pytest.mark.long
def test_the_answer_is_of_the_motion_and_not_of_the_port():
    found = find_gap(PendulumEquation(), [swinging()], effects=["mass", "viscous_friction"])
    assert [verdict.kind for verdict in found.verdicts if verdict.kind == "confirmed"] == []
    assert any(one.kind == "bursts" for one in found.quality)
    assert found.gap.before.value < 3 * found.gap.noise_floor.value
