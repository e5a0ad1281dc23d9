"""A swing with noise, a servo that sticks, and what is said about such logs."""

import dataclasses

import numpy as np

from residual.gap.data.examine import findings
from residual.trajectories import Trajectory
from sims.pendulum_equation import PendulumEquation


def noisy(seed=0, n=400, dt=0.05):
    """A swing with noise in angle and rate, and an input that changes."""
    rng = np.random.default_rng(seed)
    times = dt * np.arange(n)
    angle = np.pi + np.sin(2 * times) + 0.003 * rng.standard_normal(n)
    rate = 2 * np.cos(2 * times) + 0.02 * rng.standard_normal(n)
    volts = np.repeat(rng.uniform(-2, 2, n // 10 + 1), 10)[: n - 1, None]
    return Trajectory("run", times, np.stack([angle, rate], axis=1), volts)


def kinds(run, simulator=None):
    return {(one.kind, one.where) for one in findings(simulator or PendulumEquation(), [run])}


def changed(run, column, rows, values):
    states = np.array(run.states)
    states[rows, column] = values
    return dataclasses.replace(run, states=states)


def sticking(breakaway, gain, seed):
    """Angle and voltage of a motor under a PI controller that sticks and overshoots."""
    rng = np.random.default_rng(seed)
    target, angle, rate, total = 0.0, 0.0, 0.0, 0.0
    angles, volts = [], []
    for row in range(1000):
        if row % 100 == 0:
            target = rng.uniform(-4, 4)
        total += (target - angle) * 0.02
        volt = np.clip(gain * (target - angle) + 60 * total - 6 * rate, -255, 255)
        angles.append(angle)
        volts.append(volt)
        for _ in range(40):
            drive = 2.8 * volt - rate / 0.15
            holding = 2.8 * (60 + (breakaway - 60) * np.exp(-((rate / 3) ** 2)))
            if rate == 0 and abs(drive) <= holding:
                continue
            new = rate + 5e-4 * (drive - holding * np.sign(rate if rate else drive))
            rate = 0.0 if rate * new < 0 else new
            angle += 5e-4 * rate
    return 0.005 * np.round(np.array(angles) / 0.005), np.array(volts)
