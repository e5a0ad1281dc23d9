"""A stretch that was knocked, held or reset does not hide what the rest shows, and is told."""

import dataclasses

import numpy as np
import pytest

from residual.gap import find_gap
from residual.gap.answer.lone import Stretch
from residual.trajectories import Trajectory
from sims.pendulum_equation import PendulumEquation
from studies.hidden.data import Truth, make_logs

MIDDLE, LONG = 125, 50
#: What is hidden among others.
OFFERED = ("sensor_offset", "mass", "coulomb_friction", "viscous_friction", "delay")


def ask(logs):
    options = {"effects": OFFERED, "hold": "zero", "minutes": 20.0}
    return find_gap(PendulumEquation(), logs, **options)


def reset(run, other):
    """A motion that goes on as another one, as if put there between two samples."""
    whole = (np.concatenate([a[:MIDDLE], b[MIDDLE:]]) for a, b in (
        (run.states, other.states), (run.actions, other.actions)))  # fmt: skip
    return Trajectory(run.name, run.times, *whole)


def by_hand(run, _):
    """A second in which a hand moves it."""
    states, turn = np.array(run.states), 2 * np.pi * np.arange(LONG) / LONG
    second = slice(MIDDLE, MIDDLE + LONG)
    states[second, 0] = states[MIDDLE, 0] + 2 * np.sin(turn) ** 2
    states[second, 1] = 4 * np.pi * np.sin(2 * turn)
    return dataclasses.replace(run, states=states)


@pytest.mark.parametrize(
    ("what", "begin", "end"),
    [(reset, 5.0, 6.5), pytest.param(by_hand, 6.5, 8.0, marks=pytest.mark.long)],
)
def test_what_the_rest_of_the_log_shows_is_named(what, begin, end):
    logs = list(make_logs(Truth(sensor_offset=0.1), 11, "strong", "A", 5))
    logs[2] = what(logs[2], logs[3])
    found = ask(logs)
    first = found.verdicts[0]
    assert first.effect == "sensor_offset"
    assert first.parameters["offset"].value == pytest.approx(0.1, rel=0.05)
    (said,) = [one for one in found.quality if "one stretch" in one]
    assert f"run 2 from {begin:.4g}" in said or f"to {end:.4g} s" in said
    assert said.endswith("It was left out of everything that is said")


def test_no_stretch_is_told_of_a_log_without_one():
    found = ask(make_logs(Truth(sensor_offset=0.1), 11, "strong", "A", 5))
    assert not [one for one in found.quality if "one stretch" in one]


def test_a_run_without_a_stretch_of_its_own_is_two():
    times = np.arange(10.0)
    runs = [
        Trajectory(name, times, np.stack([times, times], axis=1), times[:-1, None])
        for name in ("a", "b")
    ]
    cut = Stretch("b", 3.0, 5.0, 0.9).cut_from(runs)
    assert [(run.name, run.times.tolist()) for run in cut] == [
        ("a", times.tolist()),
        ("b", [0.0, 1.0, 2.0]),
        ("b", [6.0, 7.0, 8.0, 9.0]),
    ]
    assert [run.actions[:, 0].tolist() for run in cut[1:]] == [[0.0, 1.0], [6.0, 7.0, 8.0]]
    (begun,) = Stretch("b", 0.0, 5.0, 0.9).cut_from(runs[1:])
    assert begun.times.tolist() == [6.0, 7.0, 8.0, 9.0]
