"""A remainder that repeats at one frequency is told, and what a drive makes is not taken for it."""

import numpy as np
import pytest
from trolley import DT, ROWS, Trolley

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.effects import FlexiblePart
from studies.gap.files import gap_record
from studies.gap.summary import summary

#: Friction is left out, so that it has no name where it is missing.
ASKED = ("mass", "stiffness", "damping")


def runs(disturbed=lambda time, phase: 0.0, friction=0.0, swings=None):
    """Two records, by many small steps of the exact equations."""
    found = []
    for seed in (0, 1):
        rng, fine = np.random.default_rng(seed), 20
        times = DT * np.arange(ROWS)
        pushes = np.repeat(rng.uniform(-10, 10, ROWS // 20), 20)
        if swings is not None:
            pushes = 8 * np.sin(2 * np.pi * swings * times)
        place = speed = 0.0
        path, phase = [], rng.uniform(0, 2 * np.pi)
        for row in range(ROWS):
            path.append((place, speed))
            for k in range(fine):
                now = times[row] + k * DT / fine
                pull = 20 * place + speed + friction * np.tanh(speed / 0.02)
                speed += DT / fine * (pushes[row] + disturbed(now, phase) - pull) / 2.0
                place += DT / fine * speed
        seen = np.array(path) + rng.standard_normal((ROWS, 2)) * [1e-3, 5e-3]
        found.append(Trajectory(f"run {seed}", times, seen, pushes[:-1, None]))
    return found


def ask(records):
    return find_gap(Trolley(), records, effects=ASKED, minutes=1)


@pytest.fixture(scope="module")
def disturbed():
    return ask(runs(lambda time, phase: 1.5 * np.sin(2 * np.pi * 2.3 * time + phase)))


def test_its_frequency_and_size_are_told(disturbed):
    found = disturbed.periodic
    assert found.joint == "place" and found.taken > 0.8
    assert found.frequency == pytest.approx(2.3, abs=0.03)
    assert found.size == pytest.approx(1.5, rel=0.15) and found.unit == "N"
    assert "it looks like something that repeats at 2.3 Hz" in " ".join(summary(disturbed).split())
    assert gap_record(disturbed, {})["periodic"]["joint"] == "place"


@pytest.mark.parametrize("swings", [pytest.param(None, marks=pytest.mark.long), 0.7])
def test_friction_that_is_missing_repeats_no_more_than_its_drive(swings):
    assert ask(runs(friction=1.5, swings=swings)).periodic is None


def test_nothing_repeats_where_nothing_is_missing():
    assert ask(runs()).periodic is None


def test_a_part_on_a_spring_does_not_hide_what_repeats():
    found = find_gap(
        Trolley(), runs(lambda time, phase: 1.5 * np.sin(2 * np.pi * 2.3 * time + phase)),
        effects=FlexiblePart("place"), minutes=1,
    )  # fmt: skip
    assert not any(verdict.kind == "confirmed" for verdict in found.verdicts)
    assert found.effects and found.periodic.instead == "flexible_part@place"
    told = " ".join(summary(found).split())
    assert told.startswith("It looks like something that repeats at 2.")
    assert "flexible part at place stands for whatever swings so. If that is not it" in told
