"""A propeller's thrust grows with the square of its command; its simulator took it for straight."""

from typing import ClassVar

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.effects import QuadraticActuator
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Joint, Parameter

DT, WEIGHT, THRUST, DRAG = 0.02, 6.0, 14.0, 0.9
#: Enough to be wrong with.
OFFERED = ("quadratic_actuator", "actuator_gain", "dead_zone", "thrust", "drag", "delay")


class RotorArm(EquationOfMotion):
    """A pendulum that a propeller lifts; per unit of inertia."""

    dt = DT
    state_channels = (
        Channel("angle", "rad", "position", scale=1.0),
        Channel("rate", "rad/s", "rate", rate_of="angle", scale=2.0),
    )
    action_channels = (Channel("throttle", "1", "input", low=0.0, high=1.0, scale=1.0),)
    joints = (Joint("arm", "angle", "rate", unit="rad/s^2", scale=6.0),)
    parameters: ClassVar = {
        "weight": Parameter(WEIGHT, "1/s^2", "gravity over the arm's length", low=0.1),
        "thrust": Parameter(THRUST, "rad/s^2", "at full throttle", low=0.1),
        "drag": Parameter(DRAG, "1/s", "of the bearing", low=0.0, family="dissipation"),
    }

    def acceleration(self, q, v, u, force, p):
        lift = p.thrust * u[:, 0]
        return (lift - p.weight * np.sin(q[:, 0]) - p.drag * v[:, 0] + force[:, 0])[:, None]


def flight(seed, power=2.0, steps=500):
    """A log by SciPy, thrust a power of the throttle."""
    rng = np.random.default_rng(seed)
    throttle = np.repeat(rng.uniform(0.0, 0.9, steps // 25), 25)
    states, within = [np.array([0.2, 0.0])], DT * np.arange(1, 26)
    for u in throttle[::25]:
        lift = THRUST * u**power
        states.extend(solve_ivp(
            lambda _, s, lift=lift: [s[1], lift - WEIGHT * np.sin(s[0]) - DRAG * s[1]],
            (0, within[-1]), states[-1], t_eval=within, rtol=1e-8, atol=1e-10,
        ).y.T)  # fmt: skip
    angle = np.array(states)[:, :1] + rng.normal(0, 2e-3, (steps + 1, 1))
    seen = np.hstack([angle, np.full_like(angle, np.nan)])
    return Trajectory(f"flight {seed}", DT * np.arange(steps + 1), seen, throttle[:, None])


@given(
    square=st.floats(0, 1), full=st.floats(0.1, 1e3), share=st.lists(st.floats(-3, 3), min_size=2)
)
def test_it_is_odd_rises_and_leaves_full_commands(square, full, share):
    actuator = QuadraticActuator("throttle", square, full)
    commands = full * np.sort(share)
    out = actuator.shape(commands)
    assert (np.diff(out) >= -1e-9 * full).all()
    np.testing.assert_allclose(actuator.shape(-commands), -out)
    np.testing.assert_allclose(actuator.shape(np.array([full, -full])), [full, -full])


def test_its_slope_has_no_jump_at_full_command():
    actuator = QuadraticActuator("throttle", 0.7, 2.0)
    below, at, above = actuator.shape(np.array([2.0 - 1e-6, 2.0, 2.0 + 1e-6]))
    assert above - at == pytest.approx(at - below, rel=1e-5)
    assert (at - below) / 1e-6 == pytest.approx(1.7, rel=1e-5)


@pytest.fixture(scope="module")
def squares():
    return find_gap(RotorArm(), [flight(seed) for seed in range(3)], effects=OFFERED)


def test_thrust_that_grows_with_the_square_is_named(squares):
    first = squares.verdicts[0]
    assert (first.kind, first.effect, first.where) == (
        "confirmed",
        "quadratic_actuator",
        "throttle",
    )
    assert first.shape == {"full": 1.0}, "0.9 was commanded of 1.0, so full throttle is known"
    square = first.parameters["square"]
    assert square.value == pytest.approx(1.0, abs=0.05)
    assert square.high == 1.0


def test_the_corrected_simulator_forecasts_fresh_flights(squares):
    fresh = flight(9)
    start = fresh.states[0].copy()
    start[1] = 0.0
    host = squares.corrected
    errors = []
    for simulator in (RotorArm(), host):
        path = simulator.rollout(simulator.augment(start[None])[0], fresh.actions[:50])
        errors.append(np.abs(path[:51, 0] - fresh.states[:51, 0]).mean())
    assert errors[1] < 0.1 * errors[0]


def test_a_propeller_as_in_the_simulator_has_no_gap():
    runs = [flight(seed, power=1.0) for seed in range(3)]
    found = find_gap(RotorArm(), runs, effects=OFFERED)
    assert [verdict.kind for verdict in found.verdicts] == ["no_gap"]
