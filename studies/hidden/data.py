"""Logs of a pendulum in which a physical effect is hidden, made by an independent integrator.

The motion is integrated by SciPy's DOP853 on the written-out equation, never by a simulator of
this project: data made by the program that later explains them would prove nothing.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from residual.trajectories import Trajectory
from studies.hidden.play import integrate_play

Array = NDArray[np.float64]
Excitation = Literal["strong", "weak", "policy"]

DT = 0.05
LIMIT = 3.0
#: Largest input in V under each excitation.
REACH: Mapping[Excitation, float] = {"strong": LIMIT, "weak": 0.8, "policy": LIMIT}
INERTIA, MASS, LENGTH, GRAVITY = 1.91e-4, 0.055, 0.042, 9.81
DAMPING, TORQUE_CONSTANT, RESISTANCE = 3e-6, 0.0536, 9.5
#: Speed below which dry friction of the truth is smoothed, in rad/s.
STICK_SPEED = 4e-3


@dataclasses.dataclass(frozen=True)
class Noise:
    """How a log is measured.

    Args:
        angle: Standard deviation of the angle in rad.
        rate: Standard deviation of the rate in rad/s; None if the rate is not measured.
        step: Quantisation step of the angle in rad, 0 for none.
    """

    angle: float
    rate: float | None
    step: float = 0.0


#: Fields of the truth that are relative changes, and those that cannot be negative.
RELATIVE = ("mass", "inertia", "length", "actuator_gain", "sensor_scale")
NOT_NEGATIVE = (
    "viscous_friction", "coulomb_friction", "stribeck_friction", "stribeck_speed",
    "quadratic_drag", "dead_zone", "saturation", "delay", "actuator_lag", "backlash", "resonance",
)  # fmt: skip

NOISES: Mapping[str, Noise] = {
    "A": Noise(angle=0.01, rate=0.2),
    "B": Noise(angle=0.0, rate=None, step=0.002),
    "C": Noise(angle=0.01, rate=None),
}


@dataclasses.dataclass(frozen=True)
class Truth:
    """The pendulum with hidden effects; every field at its default is the nominal pendulum.

    Torques are in N m, ``mass``, ``inertia``, ``length`` and ``actuator_gain`` are relative
    changes, ``backlash`` is a width in rad, ``resonance`` is a second mass on a spring (stiffness
    in N m/rad), an effect that no library holds, and ``wind`` is a torque that follows the angle's
    sine twice a turn and decays with speed.
    """

    viscous_friction: float = 0.0
    coulomb_friction: float = 0.0
    stribeck_friction: float = 0.0
    stribeck_speed: float = 1.5
    quadratic_drag: float = 0.0
    linear_spring: float = 0.0
    cubic_spring: float = 0.0
    spring_center: float = 0.0
    constant_load: float = 0.0
    cogging: float = 0.0
    cogging_order: int = 5
    cogging_phase: float = 0.4
    mass: float = 0.0
    inertia: float = 0.0
    length: float = 0.0
    actuator_gain: float = 0.0
    actuator_bias: float = 0.0
    dead_zone: float = 0.0
    saturation: float = np.inf
    delay: float = 0.0
    actuator_lag: float = 0.0
    backlash: float = 0.0
    sensor_offset: float = 0.0
    sensor_scale: float = 0.0
    resonance: float = 0.0
    wind: float = 0.0

    def __post_init__(self) -> None:
        least = {name: -1.0 for name in RELATIVE} | {name: 0.0 for name in NOT_NEGATIVE}
        for name, low in least.items():
            value = getattr(self, name)
            if not (value > low or value == low == 0):
                expected = "0 or more" if low == 0 else f"more than {low:g}"
                raise ValueError(f"truth.{name} is {value:g}, expected {expected}")

    def torque(self, angle: Array, rate: Array) -> Array:
        """Joint torque of the hidden effects in N m, all but gravity and motor."""
        sign = np.tanh(rate / STICK_SPEED)
        swing = angle - self.spring_center
        stribeck = np.exp(-((rate / self.stribeck_speed) ** 2))
        return (
            -self.viscous_friction * rate
            - (self.coulomb_friction + self.stribeck_friction * stribeck) * sign
            - self.quadratic_drag * rate * np.abs(rate)
            - self.linear_spring * swing
            - self.cubic_spring * swing**3
            + self.constant_load
            + self.cogging * np.sin(self.cogging_order * angle + self.cogging_phase)
            + self.wind * np.sin(2 * angle) * np.exp(-np.abs(rate) / 5)
        )

    def applied(self, state: Array, volts: Array) -> Array:
        """Volts at the motor under these commands."""
        volts = state[2] if self.actuator_lag > 0 else volts
        volts = np.sign(volts) * np.maximum(np.abs(volts) - self.dead_zone, 0)
        volts = np.clip(volts, -self.saturation, self.saturation)
        return (1 + self.actuator_gain) * volts + self.actuator_bias

    def free_speed(self, state: Array, volts: Array) -> Array:
        """Rate in rad/s at which the motor would run without load, seen from the joint."""
        return self.applied(state, volts) / TORQUE_CONSTANT - state[1]

    def derivative(self, state: Array, volts: Array, driven: bool = True) -> Array:
        """Time derivative of (angle, rate, lagged input, second angle, second rate)."""
        angle, rate, lagged, second, second_rate = state
        if self.actuator_lag > 0:
            lagged_dot = (volts - lagged) / self.actuator_lag
        else:
            lagged_dot = np.zeros_like(lagged)
        current = (self.applied(state, volts) - TORQUE_CONSTANT * rate) / RESISTANCE
        weight = MASS * (1 + self.mass) * GRAVITY * LENGTH * (1 + self.length)
        coupling = self.resonance * (second - angle) + 1e-2 * self.resonance * (second_rate - rate)
        torque = (
            weight * np.sin(angle)
            - DAMPING * rate
            + TORQUE_CONSTANT * current * driven
            + self.torque(angle, rate)
            + coupling
        )
        inertia = INERTIA * (1 + self.inertia)
        return np.stack(
            [rate, torque / inertia, lagged_dot, second_rate, -coupling / (0.2 * INERTIA)]
        )


def integrate(truth: Truth, states: Array, volts: Array, seconds: float) -> Array:
    """Advance all columns of ``states`` (5, n) under constant ``volts`` (n,)."""
    shape = states.shape
    found = solve_ivp(
        lambda _, y: truth.derivative(y.reshape(shape), volts).ravel(), (0.0, seconds),
        states.ravel(), "DOP853", rtol=1e-9, atol=1e-10, first_step=min(seconds, 0.01),
    )  # fmt: skip
    if found.status < 0:
        raise ArithmeticError(f"DOP853 gave up at {found.t[-1]:.4g} of {seconds:.4g} s: {truth}")
    return found.y[:, -1].reshape(shape)


def random_steps(
    rng: np.random.Generator, runs: int, steps: int, limit: float, longest: int
) -> Array:
    """Random levels held for 1 to ``longest`` control steps, shape (runs, steps), in V."""
    volts = np.empty((runs, steps))
    for run in range(runs):
        k = 0
        while k < steps:
            hold = int(rng.integers(1, longest + 1))
            volts[run, k : k + hold] = rng.uniform(-limit, limit)
            k += hold
    return volts


def swing_up(rng: np.random.Generator, runs: int) -> Callable[[Array, Array], Array]:
    """A feedback policy with exploration noise: pumps energy, then balances upright.

    Returns:
        Volts (n,) from measured angle (n,) and rate (n,); called once for each control step.
    """
    drift = np.zeros(runs)

    def policy(angle: Array, rate: Array) -> Array:
        drift[:] = 0.85 * drift + 0.4 * rng.standard_normal(len(drift))
        tilt = (angle + np.pi) % (2 * np.pi) - np.pi
        energy = 0.5 * INERTIA * rate**2 + MASS * GRAVITY * LENGTH * (np.cos(tilt) - 1)
        pump = np.where(energy < 0, 3.0, -1.5) * np.sign(rate + 1e-3)
        balance = -(14.0 * tilt + 1.4 * rate)
        close = (np.abs(tilt) < 0.5) & (np.abs(tilt + 0.1 * rate) < 0.5)
        return np.clip(np.where(close, balance, pump) + drift, -LIMIT, LIMIT)

    return policy


def simulate(
    truth: Truth, rng: np.random.Generator, excitation: Excitation, runs: int, steps: int
) -> tuple[Array, Array]:
    """True motion: states (runs, steps + 1, 2) and recorded volts (runs, steps)."""
    hanging = excitation != "strong"
    states = np.zeros((5, runs))
    states[0] = np.pi + rng.uniform(-0.3, 0.3, runs) * (1 if hanging else 10)
    states[1] = 0.0 if hanging else rng.uniform(-5, 5, runs)
    states[3:] = states[:2]
    gaps = np.zeros(runs)
    volts = random_steps(rng, runs, steps, REACH[excitation], 8)
    policy = swing_up(rng, runs)
    path = np.empty((runs, steps + 1, 2))
    path[:, 0] = states[:2].T
    whole, part = divmod(truth.delay, DT)
    for k in range(steps):
        if excitation == "policy":
            seen = path[:, k] + rng.normal(size=(runs, 2)) * (0.01, 0.2)
            volts[:, k] = policy(*seen.T)
        if k == 0:
            states[2] = volts[:, 0]
        pieces = [(part, k - int(whole) - 1), (DT - part, k - int(whole))]
        for seconds, source in pieces:
            if seconds <= 1e-12:
                continue
            command = volts[:, max(source, 0)]
            if truth.backlash:
                states = integrate_play(truth, states, gaps, command, seconds)
            else:
                states = integrate(truth, states, command, seconds)
        path[:, k + 1] = states[:2].T
    return path, volts


def measure(truth: Truth, path: Array, noise: Noise, rng: np.random.Generator) -> Array:
    """What the sensors report of a true motion (..., 2); an unmeasured rate is NaN."""
    angle = (1 + truth.sensor_scale) * path[..., 0] + truth.sensor_offset
    angle = angle + noise.angle * rng.standard_normal(angle.shape)
    if noise.step:
        angle = noise.step * np.round(angle / noise.step)
    if noise.rate is None:
        rate = np.full_like(angle, np.nan)
    else:
        rate = path[..., 1] + noise.rate * rng.standard_normal(angle.shape)
    return np.stack([angle, rate], axis=-1)


def make_logs(
    truth: Truth,
    seed: int | Sequence[int],
    excitation: Excitation = "strong",
    noise: str = "A",
    runs: int = 15,
    steps: int = 250,
) -> list[Trajectory]:
    """One set of logs: ``runs`` trajectories of ``steps`` control steps with hidden effects.

    Motion and noise come from separate streams of ``seed``, so that the same seed with another
    ``noise`` measures the same motion.
    """
    motion, sensor = np.random.default_rng(seed).spawn(2)
    path, volts = simulate(truth, motion, excitation, runs, steps)
    seen = measure(truth, path, NOISES[noise], sensor)
    times = DT * np.arange(steps + 1, dtype=float)
    return [Trajectory(f"run {i}", times, seen[i], volts[i][:, None]) for i in range(runs)]
