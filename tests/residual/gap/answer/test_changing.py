"""A parameter that changes along the records about its nominal value is told, and only then."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims import Channel, EquationOfMotion, Parameter
from studies.gap.files import gap_record
from studies.gap.summary import summary

DT, ROWS = 0.05, 500


class Trolley(EquationOfMotion):
    """A mass on a spring with a damper."""

    dt = DT
    state_channels = (
        Channel("place", "m", "position"),
        Channel("speed", "m/s", "rate", rate_of="place", scale=1.0),
    )
    action_channels = (Channel("push", "N", "input", scale=10.0, low=-20, high=20),)
    parameters = {
        "mass": Parameter(2.0, "kg", "of the trolley", low=0.1),
        "stiffness": Parameter(20.0, "N/m", "of the spring", low=0.0),
        "damping": Parameter(1.0, "N s/m", "of the damper", low=0.0),
    }

    def acceleration(self, q, v, u, force, p):
        pull = p.stiffness * q[:, 0] + p.damping * v[:, 0]
        return ((force[:, 0] + u[:, 0] - pull) / p.mass)[:, None]


def record(seed, stiffness, friction=0.0, damping=lambda place: 1.0):
    """A record by SciPy; ``stiffness`` of the part of the record that has passed."""
    rng = np.random.default_rng(seed)
    pushes = np.repeat(rng.uniform(-10, 10, ROWS // 20 + 1), 20)[:ROWS]
    state, path = np.zeros(2), [np.zeros(2)]
    for row in range(ROWS - 1):
        spring, push = stiffness(row / ROWS), pushes[row]

        def moves(_, x, spring=spring, push=push):
            dry = friction * np.tanh(x[1] / 0.01)
            braked = damping(x[0]) * x[1] + dry
            return [x[1], (push - spring * x[0] - braked) / 2.0]

        state = solve_ivp(moves, (0, DT), state, rtol=1e-8, atol=1e-10).y[:, -1]
        path.append(state)
    seen = np.array(path) + rng.standard_normal((ROWS, 2)) * [1e-3, 5e-3]
    return Trajectory(f"run {seed}", DT * np.arange(ROWS), seen, pushes[:-1, None])


def ask(*records):
    return find_gap(Trolley(), list(records), minutes=1)


def test_a_spring_that_weakens_about_its_nominal_is_told_with_both_ends():
    result = ask(*(record(seed, lambda part: 23.0 - 6.0 * part) for seed in (0, 1)))
    found = result.changing
    assert found is not None and found.label == "stiffness"
    assert (found.begin, found.end) == (pytest.approx(23, abs=0.7), pytest.approx(17, abs=0.7))
    assert found.nominal == 20.0 and found.taken > 0.5
    told = " ".join(summary(result).split())
    assert "The rest looks like stiffness that changes along the records, from about 2" in told
    assert "it looks as if stiffness went from about 2" in told and "(20 N/m in the sim" in told
    assert gap_record(result, {})["changing"]["label"] == "stiffness"


@pytest.mark.parametrize("friction", [0.0, 0.8])
def test_what_stays_the_same_changes_nothing(friction):
    """Also where something is missing, and named."""
    assert ask(*(record(seed, lambda _: 20.0, friction) for seed in (2, 3))).changing is None


def test_what_is_different_in_the_middle_of_a_record_is_no_change_along_it():
    """A stiffness that comes and goes twice in a record."""
    records = [record(seed, lambda part: 20 + 4 * np.sin(4 * np.pi * part)) for seed in (4, 5)]
    found = ask(*records).changing
    assert found is None or found.taken < 0.5


def test_a_damper_that_follows_the_place_is_told_with_both_ends():
    def damping(place):
        return 1.0 + 0.8 * place

    result = ask(*(record(seed, lambda _: 20.0, damping=damping) for seed in (6, 7)))
    found = result.changing
    assert found is not None and (found.label, found.over) == ("damping", "place")
    for told, place in ((found.begin, found.low), (found.end, found.high)):
        assert told == pytest.approx(damping(place), abs=0.15)
    assert not result.effects
    told = " ".join(summary(result).split())
    assert "it looks as if damping changed with place, from about 0." in told
    assert "The rest looks like damping that changes with place" in told
    assert gap_record(result, {})["changing"]["over_unit"] == "m"
