"""A servo that sticks, breaks away and hunts: where its friction is sought, and what is named."""

from __future__ import annotations

import functools
from typing import ClassVar

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from swing import sticking

from residual.gap.data.samples import Samples
from residual.gap.find import find_gap
from residual.gap.fitting.short_forecasts import ShortForecasts
from residual.gap.model.candidates import candidates
from residual.gap.model.model import Model
from residual.gap.model.paths import variation
from residual.gap.preparation.horizon import usual_horizon
from residual.gap.preparation.prepare import Prepared, prepare
from residual.gap.search.global_search import GlobalSearch, _Space
from residual.trajectories import Trajectory
from sims.effects import ActuatorGain, StribeckFriction
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter


class Servo(EquationOfMotion):
    dt = 0.02
    state_channels = (
        Channel("angle", "rad", "position", scale=3.0),
        Channel("rate", "rad/s", "rate", rate_of="angle", scale=10.0),
    )
    action_channels = (Channel("pwm", "1", "input", scale=100.0, low=-255.0, high=255.0),)
    parameters: ClassVar = {
        "gain": Parameter(0.2, "rad/s", "speed of a count"),
        "time_constant": Parameter(0.15, "s", "time constant"),
        "inertia": Parameter(1e-3, "kg m^2", "inertia"),
    }

    def acceleration(self, q, v, u, force, p):
        driven = (p.gain * u[:, 0] - v[:, 0]) / p.time_constant
        return (driven + force[:, 0] / p.inertia)[:, None]


@functools.cache
def hunting(breakaway: float = 110.0, seed: int = 1) -> Trajectory:
    """Friction of 0.168 N m, at rest 2.8e-3 times ``breakaway``; 2.1 times the nominal drive."""
    angle, volts = sticking(breakaway, 120.0, seed)
    states = np.stack([angle, np.full(len(angle), np.nan)], axis=1)
    return Trajectory("hunting", 0.02 * np.arange(len(angle)), states, volts[:-1, None])


def true_numbers(breakaway: float) -> np.ndarray:
    """Sliding friction and breakaway in N m, speed between them in rad/s, gain: see ``hunting``."""
    return np.array([0.168, 2.8e-3 * breakaway, 3.0, 1.1])


def ready(breakaway: float, seed: int) -> tuple[Prepared, Model]:
    """The servo's log, and the servo with friction and another gain."""
    servo, run = Servo(), hunting(breakaway, seed)
    prepared = prepare(servo, [run], usual_horizon(servo, [run]))
    effects = (StribeckFriction("angle"), ActuatorGain("pwm"))
    return prepared, Model(servo, candidates(servo, effects, prepared.fitter.samples))


@given(rest=st.integers(0, 900), seed=st.integers(0, 9))
@settings(max_examples=30)
def test_rest_does_not_make_motion_small(rest, seed):
    moving = np.random.default_rng(seed).standard_normal((100, 2))
    states = np.vstack([moving, np.zeros((rest, 2))])
    times = 0.02 * np.arange(len(states))
    samples = Samples.join([Trajectory("run", times, states, np.zeros((len(states) - 1, 1)))], 1)
    usual, still = (variation(samples, nodes) for nodes in (np.tile(moving, (10, 1)), states))
    assert (still > 0.5 * np.sqrt(100 / len(states)) * usual[: len(still)]).all()


def test_the_start_of_a_forecast_is_found_where_most_of_a_record_is_rest():
    """A record that begins at rest under the full voltage: its first difference is no rate."""
    prepared, model = ready(110.0, 13)
    fitter, theta = prepared.fitter, true_numbers(110.0)
    fit = fitter.fit(model, theta)
    every = np.zeros(len(fitter.blocks.windows), np.int64)
    squares = fitter.foretell(model, theta[None], every, fit).squares
    assert np.sqrt(squares.max()) < 0.05


@pytest.mark.parametrize(("breakaway", "seed"), [(90.0, 17), (110.0, 11), (90.0, 19), (90.0, 20)])
@pytest.mark.parametrize("parts", [1, 8])
def test_forecasts_of_parts_tell_breakaway_from_twice_the_friction(breakaway, seed, parts):
    """Friction without breakaway does best where it and the gain are about twice the true ones."""
    prepared, model = ready(breakaway, seed)
    plain = np.stack([[s, 0.0, 3.0, 6 * s - 0.15] for s in np.linspace(0.2, 0.6, 81)])
    misses = ShortForecasts(prepared.fitter, model, parts).misses(
        np.vstack([true_numbers(breakaway), plain])
    )
    assert misses[0] + np.log(9) < misses[1:].min()


@pytest.mark.parametrize(
    ("breakaway", "seed"),
    [
        (90.0, 41), pytest.param(110.0, 42, marks=pytest.mark.long),
        pytest.param(90.0, 43, marks=pytest.mark.long),
    ],
)  # fmt: skip
def test_friction_that_slopes_miss_is_found(breakaway, seed):
    prepared, model = ready(breakaway, seed)
    fitter = prepared.fitter
    small = np.array([0.005, 0.04, 1.5, 0.1])
    by_slopes = fitter.fit(model, small)
    found = GlobalSearch(prepared.floor.sigma, np.inf).better(fitter, by_slopes, 4, small)
    told, wanted = found.theta[[0, 1, 3]], true_numbers(breakaway)[[0, 1, 3]]
    assert told == pytest.approx(wanted, rel=0.1)


@given(
    sliding=st.floats(1e-3, 0.1), times=st.floats(1.01, 4.0),
    speed=st.floats(0.1, 50), gain=st.floats(-0.5, 2.0),
)  # fmt: skip
@settings(max_examples=50)
def test_friction_is_sought_where_it_breaks_away_harder_than_it_slides(sliding, times, speed, gain):
    servo = Servo()
    samples = Samples.join([hunting()], 20)
    found = candidates(servo, (StribeckFriction("angle"), ActuatorGain("pwm")), samples)
    theta = np.array([sliding, sliding * times, speed, gain])
    space = _Space(Model(servo, found), theta, 4)
    np.testing.assert_allclose(space.numbers(space.point(theta)[None])[0], theta, rtol=1e-4)
    corners = space.numbers(np.stack([space.low, space.high]))
    assert (corners[:, 1] >= corners[:, 0]).all()


@pytest.mark.long
@pytest.mark.parametrize(("breakaway", "seed"), [(110.0, 1), (90.0, 2), (110.0, 5), (110.0, 6)])
def test_of_a_servo_that_hunts_nothing_wrong_is_certain(breakaway, seed):
    """The same servo's other motion is foretold, however few blocks of the log can be."""
    found = find_gap(Servo(), [hunting(breakaway, seed)], held_out=[hunting(breakaway, 100 + seed)])
    told = {v.effect: v for v in found.verdicts if v.kind == "confirmed"}
    assert set(told) <= {"stribeck_friction", "actuator_gain", "gain"}
    named = {v.effect for v in found.verdicts if v.kind in ("confirmed", "ambiguous")}
    assert "stribeck_friction" in named
    assert found.held_out.after.value < 0.02 * found.held_out.before.value
    if "stribeck_friction" in told:
        breaking = told["stribeck_friction"].parameters["breakaway"].value
        assert breaking == pytest.approx(2.8e-3 * breakaway, rel=0.05)
