"""A weight off the axis of what turns, against SciPy, and where it is looked for."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.effects import Cogging, Unbalance, library
from sims.equations import EquationOfMotion
from sims.pendulum import Pendulum
from sims.pendulum_equation import PendulumEquation
from sims.simulator import TURNS, Channel

DT, GAIN, LAG, SINE, COSINE = 0.02, 0.5, 0.15, -5.0, 3.0


class Wheel(EquationOfMotion):
    """A motor that follows a voltage, and nothing that gravity pulls at."""

    dt, unit, spring = DT, "rad", 0.0
    state_channels = (
        Channel("angle", "rad", "position"),
        Channel("speed", "rad/s", "rate", rate_of="angle"),
    )
    action_channels = (Channel("volts", "V", "input", low=-12.0, high=12.0),)
    parameters = {}

    def acceleration(self, q, v, u, force, p):
        one = TURNS[self.unit] / TURNS["rad"]
        return (GAIN * one * u[:, :1] - v[:, :1]) / LAG - self.spring * q[:, :1] + force


class InDegrees(Wheel):
    unit = "deg"
    state_channels = (
        Channel("angle", "deg", "position"),
        Channel("speed", "deg/s", "rate", rate_of="angle"),
    )


class Sprung(Wheel):
    spring = 4.0


class Hanging(Wheel):
    def acceleration(self, q, v, u, force, p):
        return super().acceleration(q, v, u, force, p) - 9.0 * np.sin(q[:, :1])


def record(seed, most=8.0):
    rng = np.random.default_rng(seed)
    volts, x = np.repeat(rng.uniform(-most, most, 25), 20), np.zeros(2)
    rows = [x]
    for u in volts:
        path = solve_ivp(
            lambda _, x, u=u: [
                x[1], (GAIN * u - x[1]) / LAG + SINE * np.sin(x[0]) + COSINE * np.cos(x[0])
            ],
            (0.0, DT), x, rtol=1e-9, atol=1e-11,
        )  # fmt: skip
        x = path.y[:, -1]
        rows.append(x)
    return Trajectory(f"run {seed}", DT * np.arange(len(rows)), np.array(rows), volts[:, None])


@pytest.mark.parametrize("kind", [Wheel, InDegrees])
def test_it_moves_as_scipy_says(kind):
    one = TURNS[kind.unit] / TURNS["rad"]
    run = record(3)
    simulator = kind(effects=[Unbalance("angle", SINE * one, COSINE * one)])
    after = simulator.step(run.states[:-1] * one, run.actions) / one
    np.testing.assert_allclose(after, run.states[1:], rtol=1e-5, atol=1e-5)


def test_compiled_as_written_out():
    """The pendulum's kernel takes it for a cogging of order one."""
    rng = np.random.default_rng(0)
    states, volts = rng.uniform(-3, 3, (40, 2)), rng.uniform(-3, 3, (40, 1))
    there = Pendulum(effects=[Unbalance("pivot", 2e-3, 1e-3)]).step(states, volts)
    same = Pendulum(effects=[Cogging("pivot", 2e-3, 1e-3, 1.0)]).step(states, volts)
    np.testing.assert_array_equal(there, same)


@pytest.mark.parametrize(
    ("kind", "there"),
    [(Wheel, True), (InDegrees, True), (Sprung, True), (Hanging, False), (PendulumEquation, False)],
)
def test_it_is_looked_for_where_nothing_pulls_by_direction(kind, there):
    assert any(isinstance(effect, Unbalance) for effect in library(kind())) == there


@pytest.mark.long
def test_it_is_named_where_it_shows():
    rng = np.random.default_rng(5)
    runs = [record(0), record(1)]
    for run in runs:
        run.states[:] += rng.normal(0.0, [2e-3, 3e-2], run.states.shape)
    offered = ("unbalance", "linear_spring", "constant_load", "coulomb_friction", "actuator_gain")
    found = find_gap(Wheel(), runs, effects=offered)
    (named,) = [v for v in found.verdicts if v.kind != "needs_data"]
    assert (named.kind, named.effect) == ("confirmed", "unbalance")
    for name, true in (("sine", SINE), ("cosine", COSINE)):
        number = named.parameters[name]
        assert number.value == pytest.approx(true, rel=0.02) and number.low <= true <= number.high
