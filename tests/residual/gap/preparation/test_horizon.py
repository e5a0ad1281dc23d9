"""How far forecasts go if the user does not say."""

from typing import ClassVar

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from residual.gap import find_gap
from residual.gap.fitting.smooth import LEAD
from residual.gap.preparation.horizon import (
    SAMPLES,
    WINDOWS,
    held_by_records,
    longest_horizon,
    usual_horizon,
)
from residual.gap.preparation.prepare import prepare
from residual.gap.preparation.suited import beyond_noise
from residual.trajectories import Trajectory
from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.leo import Leo
from sims.pendulum_equation import PendulumEquation
from sims.simulator import Channel, Parameter


def swing(period, seconds=60.0, step=0.02, size=0.4, noise=0.0, name="run"):
    times = np.arange(0, seconds, step)
    angle = np.pi + size * np.sin(2 * np.pi * times / period)
    angle = angle + noise * np.random.default_rng(0).standard_normal(len(times))
    states = np.stack([angle, np.full(len(times), np.nan)], axis=1)
    return Trajectory(name, times, states, np.sin(times)[:-1, None])


@pytest.mark.parametrize(("step", "asked", "why"), [
    (0.02, 0.5, None), (0.02, 0.04, "too far apart"), (0.1, 0.2, "too far apart"),
    pytest.param(0.02, 9.0, "too short", marks=pytest.mark.long),
])  # fmt: skip
def test_another_length_than_was_asked_for_is_told(step, asked, why):
    found = find_gap(
        PendulumEquation(), [swing(2.0, 10.0, step, noise=1e-3)], horizon=asked, effects=["mass"]
    )
    told = [one.says for one in found.quality if "a horizon of" in one.says]
    assert len(told) == (why is not None)
    assert why is None or (why in told[0] and f"{found.gap.horizon_s:.3g} s" in told[0])


class Flywheel(FirstOrderSystem):
    """It spins up by itself."""

    dt = 0.01
    state_channels = (Channel("speed", "rpm", "rate", scale=50.0),)
    action_channels = ()
    parameters: ClassVar = {"slow": Parameter(3.0, "s", "time constant", low=0.05)}

    def derivative(self, x, u, p):
        return ((100.0 - x[:, 0]) / p.slow)[:, None]


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("noise", [0.5, 9.0])
def test_noise_makes_no_motion_faster(noise, seed):
    """Noise of a third of the spread, readings alike in pairs: of 1 s it left 0.01 to 0.1 s."""
    times, rng = 0.01 * np.arange(1600), np.random.default_rng(seed)
    errors = np.repeat(rng.standard_normal(800), 2)
    speed = 100.0 * (1 - np.exp(-times / 3.0)) + noise * errors
    run = Trajectory("run", times, speed[:, None], np.zeros((1599, 0)))
    assert usual_horizon(Flywheel(), [run]) > 0.6


@pytest.mark.long
def test_a_length_beyond_the_record_is_what_it_holds_and_one_block_is_never_no_gap():
    """Rows were chosen for the length asked for, too far apart to see anything."""
    runs = [swing(2.0, 10.0, noise=1e-3)]
    found, far = (
        find_gap(PendulumEquation(), runs, horizon=asked, effects=["mass"])
        for asked in (held_by_records(PendulumEquation(), runs, 500.0), 500.0)
    )
    assert far.gap.before == found.gap.before and far.gap.blocks == 1
    assert "no_gap" not in {verdict.kind for verdict in far.verdicts}


@given(st.floats(0.8, 10))
@settings(max_examples=20)
def test_a_third_of_the_period(period):
    found = usual_horizon(PendulumEquation(), [swing(period, 8 * period)])
    assert found == pytest.approx(period / 3, rel=0.1)


@pytest.mark.parametrize("seconds", [60.0, 200.0, 1000.0])
def test_a_long_record_has_the_horizon_of_a_short_one(seconds):
    found = usual_horizon(PendulumEquation(), [swing(1.0, seconds)])
    assert found == pytest.approx(1 / 3, rel=0.2)


def test_noise_does_not_pass_for_speed():
    clean, noisy = (usual_horizon(PendulumEquation(), [swing(3.0, noise=n)]) for n in (0, 0.01))
    assert noisy == pytest.approx(clean, rel=0.1)


def test_how_often_and_in_which_order_it_was_recorded_does_not_matter():
    runs = [swing(2.0), swing(3.0, 40.0, name="other")]
    wanted = usual_horizon(PendulumEquation(), runs)
    assert usual_horizon(PendulumEquation(), runs[::-1]) == pytest.approx(wanted)
    assert usual_horizon(PendulumEquation(), runs + runs) == pytest.approx(wanted)
    late = [Trajectory(r.name, r.times + 500, r.states, r.actions) for r in runs]
    assert usual_horizon(PendulumEquation(), late) == pytest.approx(wanted)
    rare = [Trajectory(r.name, r.times[::2], r.states[::2], r.actions[1::2]) for r in runs]
    assert usual_horizon(PendulumEquation(), rare) == pytest.approx(wanted, rel=0.05)


@given(st.integers(3, 15), st.integers(10, 25))
@settings(max_examples=20)
def test_samples_in_bursts_do_not_pass_for_fast_motion(burst, pause):
    run = swing(2.0, step=0.005)
    rows = np.arange(len(run.times))
    rows = rows[rows % (burst + pause) < burst]
    rare = Trajectory(run.name, run.times[rows], run.states[rows], run.actions[rows[:-1]])
    wanted = usual_horizon(PendulumEquation(), [run])
    assert usual_horizon(PendulumEquation(), [rare]) == pytest.approx(wanted, rel=0.3)


def test_short_records_leave_room_for_windows():
    found = usual_horizon(PendulumEquation(), [swing(20.0, 10.0)])
    assert found == pytest.approx((1 - LEAD) * 10.0 / WINDOWS, rel=0.01)


@pytest.mark.parametrize("records", [1, 2, 3, 5, 6, 7, 9])
def test_short_records_alike_hold_eight_windows(records):
    """Of six that are divided evenly, seven tenths of each made six windows, not eight."""
    runs = [swing(3.0, 2.0, name=str(number)) for number in range(records)]
    ready = prepare(PendulumEquation(), runs, longest_horizon(runs))
    assert len(ready.fitter.blocks.windows) >= 8


def test_a_window_has_samples_enough():
    found = usual_horizon(PendulumEquation(), [swing(2.0, 20.0, step=0.4)])
    assert found >= (1 - LEAD) * SAMPLES * 0.4 * (1 - 1e-9)


def test_what_strikes_the_ground_is_foretold_over_ten_steps_at_least():
    states = np.zeros((50, 18))
    run = Trajectory("walk", 0.03 * np.arange(50), states, np.zeros((49, 6)))
    assert usual_horizon(Leo(), [run]) == pytest.approx(10 * Leo().dt)


class Frame(EquationOfMotion):
    """A plate that swings from a corner, without friction."""

    dt = 0.01
    state_channels = (
        Channel("angle", "rad", "position", angle=True),
        Channel("rate", "rad/s", "rate", rate_of="angle", scale=3.0),
    )
    action_channels = ()
    parameters: ClassVar = {"stiffness": Parameter(70.0, "1/s^2", "gravity over length", low=1.0)}

    def acceleration(self, q, v, u, force, p):
        return (force[:, 0] - p.stiffness * np.sin(q[:, 0]))[:, None]


def swinging(friction, noise, seconds=9.0):
    """A log of the true plate, by an independent integrator."""
    times = np.arange(0, seconds, 0.01)

    def slope(_, x):
        return [x[1], -70.0 * np.sin(x[0]) - friction * x[1]]

    found = solve_ivp(slope, (0, times[-1]), [0.4, 0.0], t_eval=times, rtol=1e-9, atol=1e-10)
    angle = found.y[0] + np.random.default_rng(3).normal(0, noise, len(times))
    states = np.stack([angle, np.full(len(times), np.nan)], axis=1)
    return Trajectory("swing", times, states, np.zeros((len(times) - 1, 0)))


@pytest.mark.parametrize("noise", [0.01, 1e-4])
def test_forecasts_go_farther_where_noise_would_hide_what_is_missing(noise):
    runs = [swinging(0.25, noise)]
    usual = usual_horizon(Frame(), runs)
    found = beyond_noise(Frame(), runs, prepare(Frame(), runs, usual))
    assert found.horizon == pytest.approx(2 * usual if noise > 1e-3 else usual)
    assert found.horizon <= longest_horizon(runs)


@pytest.mark.parametrize(("friction", "kinds"), [(0.25, {"dissipation"}), (0.0, set())])
def test_so_that_light_friction_is_found_in_a_noisy_log_and_none_where_there_is_none(
    friction, kinds
):
    found = find_gap(Frame(), [swinging(friction, 0.01)])
    named = [v for v in found.verdicts if v.kind in ("confirmed", "ambiguous")]
    assert {effect.family for effect in found.effects} == kinds
    assert bool(named) is bool(kinds)


def test_noise_is_no_less_than_what_was_rounded():
    """Whole counts of an encoder, that moves by thousands of them from sample to sample."""
    run = swinging(0.0, 0.0)
    counts = np.round(run.states * 1e6) / 1e6
    fine = Trajectory("fine", run.times, counts, run.actions)
    coarse = Trajectory("coarse", run.times, np.round(run.states * 2e3) / 2e3, run.actions)
    for log, step in ((fine, 1e-6), (coarse, 5e-4)):
        floor = prepare(Frame(), [log], 0.25).floor
        assert floor.sigma[0] >= step / np.sqrt(12) * (1 - 1e-9)


class Lever(EquationOfMotion):
    """An arm held above its hinge, without friction: it falls within a fraction of a second."""

    dt = 0.01
    state_channels = (
        Channel("angle", "rad", "position", scale=0.3),
        Channel("rate", "rad/s", "rate", rate_of="angle", scale=0.3),
    )
    action_channels = (Channel("torque", "N m", "input", scale=10.0, low=-100.0, high=100.0),)
    parameters: ClassVar = {
        "inertia": Parameter(0.1, "kg m^2", "of the arm", low=0.01),
        "weight": Parameter(20.0, "N m", "of the arm held out level", low=0.0),
    }

    def acceleration(self, q, v, u, force, p):
        return ((u[:, 0] + p.weight * np.sin(q[:, 0]) + force[:, 0]) / p.inertia)[:, None]


@pytest.mark.long
def test_of_a_slow_motion_that_is_unstable_without_what_is_missing_rows_are_close_enough():
    friction, times = 30.0, np.arange(0.0, 60.0, 0.01)
    levels = np.random.default_rng(3).uniform(-0.5, 0.5, 21)

    def slowly(t, q):
        # So much friction that its rate follows at once; a controller holds it up.
        aim = np.interp(t, np.linspace(0.0, 60.0, 21), levels)
        return (200.0 * (aim - q) + 20.0 * np.sin(q)) / friction

    solved = solve_ivp(slowly, (0, 60), [0.0], t_eval=times, rtol=1e-8, atol=1e-10)
    angle = solved.y[0]
    rate = np.array([slowly(t, q) for t, q in zip(times, angle, strict=True)])
    torque = friction * rate - 20.0 * np.sin(angle) + 0.1 * np.gradient(rate, times)
    noise = np.random.default_rng(4).normal(0, [2e-4, 2e-3], (len(times), 2))
    states = np.stack([angle, rate], axis=1) + noise
    log = [Trajectory("log", times, states, torque[:-1, None])]
    wanted = usual_horizon(Lever(), log)
    effects = ["viscous_friction", "coulomb_friction", "actuator_gain", "delay"]
    found = find_gap(Lever(), log, effects=effects, hold="linear")
    assert found.gap.horizon_s < 0.5 * wanted
    assert np.median([len(forecast.times) for forecast in found.rollouts]) > 9
    first = found.verdicts[0]
    # Its torque follows from what was measured alone, so that it is not certain.
    assert (first.kind, first.effect) == ("ambiguous", "viscous_friction")
    assert first.doubts == ("unsteady", "loop")
    assert first.parameters["coefficient"].low < friction < first.parameters["coefficient"].high
