"""Noise of thinned logs: a vibration between their rows is none, and a slow sensor has no less."""

import numpy as np
import pytest
from held import path
from scipy.integrate import solve_ivp

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims import Channel, EquationOfMotion, FirstOrderSystem, Parameter

NOISE = 2e-5


class Gantry(EquationOfMotion):
    dt = 0.01
    state_channels = (
        Channel("x", "m", "position", scale=0.3),
        Channel("x rate", "m/s", "rate", rate_of="x", scale=0.5),
    )
    action_channels = (Channel("force", "N", "input", scale=30.0, low=-80.0, high=80.0),)
    parameters = {
        "mass": Parameter(9.0, "kg", "moving mass", low=0.1),
        "damping": Parameter(20.0, "N s/m", "bearings", low=0.0),
    }

    def acceleration(self, q, v, u, force, p):
        return ((u[:, 0] + force[:, 0] - p.damping * v[:, 0]) / p.mass)[:, None]


def forces(seed, n):
    """Steps of 0.2 to 0.9 s."""
    rng = np.random.default_rng(seed)
    held = rng.integers(20, 90, n // 20)
    return np.repeat(rng.uniform(-45, 45, len(held)), held)[:n]


def run(seed, coupling=None, noise=NOISE, hold=1, n=1500):
    """A log of a gantry by SciPy; with a coupling (stiffness, damping) 4 of its 9 kg hang on it."""
    force = forces(seed, n)
    rng = np.random.default_rng(100 + seed)
    k, c = coupling or (0.0, 0.0)
    own, load = (5.0, 4.0) if coupling else (9.0, 1.0)

    def slope(t, y):
        x, v, z, w = y
        f = force[min(int(t / 0.01 + 1e-9), n - 1)]
        pull = k * (z - x) + c * (w - v)
        return [v, (f - 20.0 * v + pull) / own, w, -pull / load]

    times = 0.01 * np.arange(n + 1)
    found = solve_ivp(slope, (0, times[-1]), np.zeros(4), t_eval=times, rtol=1e-7, atol=1e-10,
                      max_step=0.01)  # fmt: skip
    x = found.y[0] + noise * rng.standard_normal(n + 1)
    x = np.repeat(x[::hold], hold)[: n + 1]
    states = np.stack([x, np.full(n + 1, np.nan)], axis=1)
    return Trajectory(f"run {seed}", times, states, force[:, None])


@pytest.mark.long
def test_a_vibration_between_the_rows_is_no_noise():
    runs = [run(seed, (1600.0, 6.0)) for seed in (0, 1)]
    offered = ("mass", "damping", "delay", "actuator_lag", "coulomb_friction", "flexible_part")
    found = find_gap(Gantry(), runs, effects=offered)
    (sigma, _) = found.noise["x"]
    assert NOISE / 2 < sigma < 3 * NOISE
    assert found.gap.before.value > 10 * sigma
    # It has a name: 4 of 9 kg on a spring.
    (named,) = (v for v in found.verdicts if v.kind in ("no_gap", "confirmed"))
    assert named.effect == "flexible_part"
    assert named.parameters["ratio"].value == pytest.approx(4.0 / 5.0, rel=0.01)
    swing = np.sqrt(1600.0 * (1 / 5.0 + 1 / 4.0)) / (2 * np.pi)
    assert named.parameters["frequency"].value == pytest.approx(swing, rel=0.01)


def test_noise_of_a_slow_sensor_is_not_read_between_its_readings():
    runs = [run(seed, noise=0.01, hold=16) for seed in (0, 1)]
    (sigma, _) = find_gap(Gantry(), runs, effects=["mass", "damping"]).noise["x"]
    assert sigma > 0.005


class Truck(FirstOrderSystem):
    """The speed of a tank truck by its drive."""

    dt = 0.05
    state_channels = (Channel("speed", "m/s", "rate", scale=8.0),)
    action_channels = (Channel("drive", "kN", "input", scale=10.0),)
    parameters = {
        "mass": Parameter(18.0, "t", "of all", low=1.0),
        "roll": Parameter(0.9, "kN s/m", "resistance", low=0.0, family="dissipation"),
    }

    def derivative(self, x, u, p):
        return ((u[:, 0] - p.roll * x[:, 0]) / p.mass)[:, None]


def sloshing(seed, n=3600):
    """A part of the load swings at 0.55 Hz, by little more than the noise of 0.02 m/s."""
    rng = np.random.default_rng(seed)
    drive = np.repeat(rng.uniform(-10.0, 24.0, n // 120), 120)
    swing, load = 2 * np.pi * 0.55, 0.26
    own = 18.0 * (1 - load)
    spring, damper = swing**2 * own * load / 1.0, 0.08 * swing * own * load

    def rates(_, x, u):
        pull = spring * x[1] + damper * (x[2] - x[0])
        return [(u - 0.9 * x[0] + pull) / own, x[2] - x[0], -pull / (18.0 * load)]

    seen = path(rates, [5.0, 0.0, 5.0], drive, 0.05)[:-1, 0]
    seen = 0.01 * np.round((seen + 0.02 * rng.standard_normal(n)) / 0.01)
    return Trajectory(f"run {seed}", 0.05 * np.arange(n), seen[:, None], drive[:-1, None])


@pytest.mark.long
def test_a_swing_little_above_the_noise_is_no_noise_over_long_forecasts():
    found = find_gap(Truck(), [sloshing(seed) for seed in range(2)])
    assert found.noise["speed"][0] == pytest.approx(0.02, rel=0.15)
    (part,) = [e for e in found.effects if e.name == "flexible_part"]
    assert part.frequency == pytest.approx(0.55, rel=0.2)
