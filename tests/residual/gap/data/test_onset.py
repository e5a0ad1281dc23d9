"""Samples before a drive came on, or a body was let go, unlogged, are told and left out."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from slides import Slide, braked, recorded

from residual.gap import find_gap
from residual.gap.data.examine import examine
from residual.trajectories import Trajectory
from sims.pendulum_equation import PendulumEquation

DT, ROWS, NOISE = 0.02, 60, 2e-4


def step(name, count, waits=0, friction=60.0, off=0):
    """A slide under ``count`` pulses from the row ``off`` on, that moves ``waits`` rows later."""
    pwm = np.where(np.arange(ROWS + off) < off, 0.0, count)
    felt = np.concatenate([np.zeros(waits), pwm[: len(pwm) - waits]])
    places = braked(0.5 * felt, friction, 4.0, DT)
    return recorded(name, places, pwm, DT, NOISE, np.random.default_rng(abs(count) + waits))


def left_out(simulator, runs):
    """Rows that are missing of every run afterwards, and the runs that are told."""
    done = examine(simulator, runs)
    told = [one.where for one in done.findings if one.kind == "onset"]
    kept = {run.name: len(run) for run in done.trajectories}
    return [len(run) - kept[run.name] for run in runs], told


@pytest.mark.parametrize("off", [0, 15])
@pytest.mark.parametrize("place", [0, 1, 3])
def test_a_drive_that_comes_on_late_in_one_record(off, place):
    runs = [step(f"run {i}", count, off=off) for i, count in enumerate((100, -150, 200))]
    runs.insert(place, step("late", 120, waits=20, off=off))
    gone, told = left_out(Slide(), runs)
    assert told == ["late"]
    assert off + 19 <= gone[place] <= off + 22
    assert sum(gone) == gone[place]


@given(waits=st.integers(0, 25), counts=st.permutations([100, -150, 200, 60]))
@settings(max_examples=20)
def test_a_delay_that_all_records_have_is_no_late_drive(waits, counts):
    runs = [step(f"run {i}", count, waits) for i, count in enumerate(counts)]
    assert left_out(Slide(), runs) == ([0] * 4, [])


def test_records_of_a_delay_that_begin_in_motion_are_no_witnesses():
    whole = step("whole", 150, waits=20)
    runs = [step("first", 150, waits=20), whole.piece(30, 45, "b"), whole.piece(44, 60, "c")]
    assert left_out(Slide(), runs) == ([0] * 3, [])


def test_a_single_record_may_have_a_delay():
    assert left_out(Slide(), [step("run", 150, waits=20)]) == ([0], [])


@pytest.mark.parametrize("grain", [0.002, 0.005, 0.02])
def test_what_a_coarse_sensor_hides_at_first_is_no_late_drive(grain):
    runs = [step("slow", 8), *(step(f"run {i}", c) for i, c in enumerate((300, -300, 320)))]
    runs = [dataclasses.replace(run, states=grain * np.round(run.states / grain)) for run in runs]
    assert left_out(Slide(), runs) == ([0] * 4, [])


def swing(held):
    """A pendulum without a motor that a hand holds for some rows and lets go, by SciPy."""
    p = {name: parameter.value for name, parameter in PendulumEquation().parameters.items()}

    def falling(_, y):
        torque = p["mass"] * p["gravity"] * p["length"] * np.sin(y[0]) - p["damping"] * y[1]
        return [y[1], torque / p["inertia"]]

    times = 0.05 * np.arange(120)
    path = solve_ivp(falling, (0, 6), [1.2, 0.0], t_eval=times, rtol=1e-8, atol=1e-8).y.T
    states = np.concatenate([np.tile(path[0], (held, 1)), path])
    states += np.array([1e-3, 1e-2]) * np.random.default_rng(held).standard_normal(states.shape)
    times = 0.05 * np.arange(len(states))
    return Trajectory("swing", times, states, np.zeros((len(states) - 1, 1)))


def test_a_pendulum_that_is_held_until_it_is_let_go():
    (gone,), told = left_out(PendulumEquation(), [swing(held=40)])
    assert told == ["swing"]
    assert 38 <= gone <= 42
    assert left_out(PendulumEquation(), [swing(held=0)]) == ([0], [])
    (finding,) = [
        f for f in examine(PendulumEquation(), [swing(held=40)]).findings if f.kind == "onset"
    ]
    assert "where its simulator moves, then moves: let go late?" in finding.says


def test_what_hangs_at_rest_until_it_is_pushed_is_kept():
    """The simulator would not have moved either: that it rests there is knowledge."""
    run = swing(held=40)
    states = np.array(run.states)
    states[:, 0] += np.pi - 1.2
    assert left_out(PendulumEquation(), [dataclasses.replace(run, states=states)]) == ([0], [])


def test_friction_is_not_made_of_a_late_drive():
    runs = [step(f"run {i}", c, friction=90.0) for i, c in enumerate((100, -150, 200))]
    runs.insert(1, step("late", 120, waits=25, friction=90.0))
    effects = ["viscous_friction", "coulomb_friction", "stribeck_friction", "delay", "dead_zone"]
    found = find_gap(Slide(), runs, effects=effects, parameter_tolerance=0.0)
    assert [v.effect for v in found.verdicts if v.kind == "confirmed"] == ["viscous_friction"]
    assert found.verdicts[0].parameters["coefficient"].value == pytest.approx(30.0, rel=0.05)
