"""A swing with noise in angle and rate, and what is said about it."""

import dataclasses

import numpy as np

from residual.gap.data import findings
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
