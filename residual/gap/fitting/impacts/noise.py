"""Noise of every channel from robust windows: the windows that fit badly hardly count."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.samples import Samples
from residual.gap.fitting.impacts.refine import grown
from residual.gap.fitting.impacts.robust import weights
from residual.gap.fitting.impacts.single_shooting import StartFit, WindowData
from residual.gap.fitting.impacts.start_states import fit_starts
from residual.gap.model.model import Model

Array = NDArray[np.float64]

#: Noise is never less than this share of a channel's typical size, not even in a simulator's rows.
FINEST = 1e-5
#: Turns of start states and noise on whole windows.
TURNS = 4


def first_guess(samples: Samples, nodes: Array) -> Array:
    """A tenth of what each measured channel usually moves from sample to sample, (m,)."""
    steps = np.abs(np.diff(nodes[:, samples.measured], axis=0))
    inside = np.ones(len(steps), bool)
    inside[[stop - 1 for _, stop in samples.runs[:-1]]] = False
    return np.maximum(0.1 * np.median(steps[inside], axis=0), 1e-9)


def spread(data: WindowData, fitted: StartFit) -> tuple[Array, Array]:
    """Noise of every measured channel and its standard error, (m,).

    One step of the EM algorithm for Student's t, start states allowed for.
    """
    count, length, measured = fitted.shown.shape
    rows = length * measured
    basis, _ = np.linalg.qr(fitted.by_start)
    leverage = (basis[:, :rows] ** 2).sum(axis=2).reshape(count, length, measured)
    square = (fitted.residual[:, :rows] ** 2).reshape(count, length, measured)
    weight = weights(fitted.costs, data.freedom)[:, None, None]
    valid = np.isfinite(data.seen)
    free = (weight * valid * (1 - leverage)).sum(axis=(0, 1))
    ratio = (weight * square).sum(axis=(0, 1)) / np.maximum(free, 1e-9)
    sigma = data.sigma * np.sqrt(np.maximum(ratio, 1e-12))
    counted = (valid * (1 - leverage)).sum(axis=(0, 1))
    return sigma, sigma / np.sqrt(2 * np.maximum(counted, 1.0))


def with_noise(data: WindowData, sigma: Array, scale: Array) -> WindowData:
    """The windows in units of another noise.

    States are moved by a quarter of it, so that the kinks of contacts are averaged; a rate by
    what such an error makes of it over an interval.
    """
    samples = data.samples
    sigma = np.maximum(sigma, FINEST * scale[samples.measured])
    moves = np.array(data.moves)
    moves[samples.measured] = 0.25 * np.minimum(sigma, 0.02 * scale[samples.measured])
    return dataclasses.replace(data, sigma=sigma, moves=moves)


def quieten(
    model: Model, theta: Array, data: WindowData, scale: Array
) -> tuple[WindowData, StartFit]:
    """Start states and noise in turns; the windows are in units of the last one."""
    fitted = grown(model, theta, data, data.guess).fitted
    for _ in range(TURNS):
        quieter = with_noise(data, spread(data, fitted)[0], scale)
        slope = _in_units_of(quieter.sigma / data.sigma, fitted)
        data = quieter
        fitted = fit_starts(model, theta, data, fitted.starts, 1, slope)
    return data, fitted


def _in_units_of(noise: Array, fitted: StartFit) -> Array:
    """The derivative by start states with every channel's noise so many times as large, (m,)."""
    slope = fitted.by_start.copy()
    rows = fitted.shown[0].size
    slope[:, :rows] /= np.tile(noise, fitted.shown.shape[1])[:, None]
    return slope
