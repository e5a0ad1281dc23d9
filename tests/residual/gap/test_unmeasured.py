"""States that nobody measured: their start is free in every window, and they are no noise."""

import functools

import numpy as np
import pytest
from held import path
from scipy.integrate import solve_ivp

from residual.gap import find_gap
from residual.gap.preparation.prepare import prepare
from residual.trajectories import Trajectory
from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.simulator import Channel, Parameter

NOISE = 0.01


class Tanks(FirstOrderSystem):
    """A pump into an upper tank, which runs into a lower one."""

    dt = 4.0
    state_channels = (
        Channel("upper", "m", "other", scale=5.0),
        Channel("lower", "m", "other", scale=5.0),
    )
    action_channels = (Channel("pump", "V", "input", scale=5.0, low=0.0, high=10.0),)
    parameters = {"outlet": Parameter(0.05, "m^0.5/s", "of the lower tank", low=1e-4)}

    def derivative(self, x, u, p):
        upper, lower = np.sqrt(np.maximum(x, 0.0)).T
        down = 0.05 * upper
        return np.stack([0.05 * u[:, 0] - down, down - p.outlet * lower], axis=1)


def levels(outlet, n=400, seed=0):
    """The lower level alone, integrated by SciPy; the log begins with water in both tanks."""
    rng = np.random.default_rng(seed)
    pump = np.repeat(rng.uniform(2.0, 4.0, n // 8), 8)
    states = path(
        lambda _, x, u: [
            0.05 * (u - np.sqrt(x[0])), 0.05 * np.sqrt(x[0]) - outlet * np.sqrt(x[1])
        ],
        [5.0, 6.0], pump, 4.0, atol=1e-8,
    )  # fmt: skip
    seen = np.full((n + 1, 2), np.nan)
    seen[:, 1] = states[:, 1] + rng.normal(0, NOISE, n + 1)
    return Trajectory("tanks", 4.0 * np.arange(n + 1), seen, pump[:, None])


class Swing(EquationOfMotion):
    """A pendulum of which a gyroscope alone is logged."""

    dt = 0.02
    state_channels = (
        Channel("angle", "rad", "position", angle=True),
        Channel("rate", "rad/s", "rate", rate_of="angle", scale=3.0),
    )
    action_channels = ()
    parameters = {"length": Parameter(0.5, "m", "to the bob", low=0.01)}

    def acceleration(self, q, v, u, force, p):
        return np.stack([-9.81 / p.length * np.sin(q[:, 0]) + force[:, 0]], axis=1)


def gyro(n=1200, seed=0):
    """Rates alone, integrated by SciPy."""
    rng = np.random.default_rng(seed)
    times = 0.02 * np.arange(n + 1)
    swing = solve_ivp(
        lambda _, x: [x[1], -9.81 / 0.5 * np.sin(x[0])],
        (0, times[-1]), [1.2, 0.0], t_eval=times, rtol=1e-9, atol=1e-9,
    ).y.T  # fmt: skip
    seen = np.column_stack([np.full(n + 1, np.nan), swing[:, 1] + rng.normal(0, NOISE, n + 1)])
    return Trajectory("gyro", times, seen, np.zeros((n, 0)))


@pytest.mark.parametrize(
    ("simulator", "log", "horizon"),
    [(Tanks(), functools.partial(levels, 0.05), 80.0), (Swing(), gyro, 0.5)],
)
def test_noise_is_found_beside_a_state_that_nobody_measured(simulator, log, horizon):
    (sigma,) = prepare(simulator, [log()], horizon).floor.sigma
    assert 0.7 * NOISE < sigma < 1.6 * NOISE


#: Enough to be wrong with.
OFFERED = ("outlet", "proportional_loss", "constant_load", "actuator_gain", "delay")


def test_a_right_simulator_has_no_gap_although_a_level_was_not_measured():
    options = {"effects": OFFERED, "horizon": 80.0, "parameter_tolerance": 0}
    found = find_gap(Tanks(), [levels(0.05)], **options)
    assert {v.kind for v in found.verdicts} <= {"no_gap", "needs_data"}
    assert found.gap.before.value < 3 * NOISE


def test_a_wrong_outlet_is_named_below_a_tank_without_a_sensor():
    found = find_gap(Tanks(), [levels(0.06)], effects=OFFERED, horizon=80.0)
    first = found.verdicts[0]
    assert "outlet" in {first.effect, *first.same_motion}
    assert first.parameters["change"].value == pytest.approx(0.01, rel=0.2)


class Motor(FirstOrderSystem):
    """A motor whose current is logged, and whose speed is not."""

    dt = 0.01
    state_channels = (
        Channel("speed", "rad/s", "rate", scale=50.0),
        Channel("current", "A", "other", scale=2.0),
    )
    action_channels = (Channel("voltage", "V", "input", scale=6.0),)
    parameters = {"constant": Parameter(0.05, "N m/A", "of the motor", low=1e-3)}

    def derivative(self, x, u, p):
        speed, current = x.T
        driven = (u[:, 0] - current - p.constant * speed) / 0.01
        return np.stack([p.constant * current / 1e-4, driven], axis=1)


def rubbing(_, x, volts):
    """Slope of the true motor."""
    return [500.0 * x[1] - 40.0 * np.tanh(x[0]), 100.0 * (volts - x[1] - 0.05 * x[0])]


@pytest.mark.long
def test_friction_of_a_speed_without_a_sensor_is_found_in_the_current():
    rng = np.random.default_rng(0)
    volts = np.repeat(rng.uniform(-6, 6, 16), 50)
    seen = path(rubbing, [0.0, 0.0], volts[:-1], 0.01, rtol=1e-7, atol=1e-7)
    seen[:, 0] = np.nan
    seen[:, 1] += rng.normal(0, 0.005, len(seen))
    log = Trajectory("log", 0.01 * np.arange(len(seen)), seen, volts[:-1, None])
    offered = ["coulomb_friction", "viscous_friction", "actuator_gain", "constant", "constant_load"]
    first = find_gap(Motor(), [log], effects=offered).verdicts[0]
    assert (first.effect, first.where) == ("coulomb_friction", "speed")
    level = first.parameters["level"]
    assert level.low < 40.0 < level.high and level.value == pytest.approx(40.0, rel=0.1)
