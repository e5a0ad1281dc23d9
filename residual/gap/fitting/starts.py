"""Start states of forecasts, fitted to the lead-ins of windows by Gauss and Newton."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from residual.gap.model.model import Model

if TYPE_CHECKING:
    from residual.gap.fitting.smooth import SmoothFitter

Array = NDArray[np.float64]

#: Gauss-Newton turns of a start state, and most of them where it is still far off.
TURNS, MOST = 3, 20


def starts(
    fitter: SmoothFitter, model: Model, thetas: Array, which: NDArray[np.int64], states: Array
) -> Array:
    """States from which windows are foretold, (W, n_s).

    Args:
        fitter: Holds the windows and how much of each is its lead-in.
        model: Simulator with effects.
        thetas: Vectors of numbers, (V, p).
        which: Which of them each window has, (W,).
        states: First guess, (W, n_s).
    """
    samples, windows, lead = fitter.samples, fitter.blocks.windows, fitter.lead
    measured, first, free = samples.measured, windows.index[:, 0], model.free
    scale = model.scales(fitter.scale)[free]
    moves, limit, ridge = 1e-3 * scale, 3 * scale, np.diag(1e-2 / scale)
    length = int(lead.sum(axis=1).max())
    seen = samples.seen[windows.index[:, :length]][..., measured]
    there = (fitter.valid & lead[..., None])[:, :length]
    ridges = np.broadcast_to(ridge, (len(windows), *ridge.shape))
    best, least = states, np.full(len(windows), np.inf)
    far = False
    for turn in range(MOST + 1):
        variants = np.repeat(states[None], 1 + len(free), axis=0)
        for row, column in enumerate(free):
            variants[1 + row, :, column] += moves[row]
        count = len(variants)
        path = fitter.shown(
            model, np.tile(first, count), variants.reshape(-1, states.shape[1]), length - 1,
            thetas, np.tile(which, count),
        ).reshape(count, len(windows), length, len(measured))  # fmt: skip
        gap = np.where(there, (seen - path[0]) / fitter.sigma, 0.0)
        gap = np.clip(gap, -1e8, 1e8).reshape(len(windows), -1)
        cost = (gap**2).sum(axis=1)
        better = cost < least
        best = np.where(better[:, None], states, best)
        least = np.where(better, cost, least)
        if turn == MOST or (turn >= TURNS and not far):
            break
        with np.errstate(over="ignore"):  # of paths that run away; clipped below
            slope = (path[1:] - path[0]) / moves[:, None, None, None] / fitter.sigma
        slope = np.where(there, np.clip(slope, -1e8, 1e8), 0.0)
        slope = slope.reshape(len(free), len(windows), -1).transpose(1, 2, 0)
        basis, triangle = np.linalg.qr(np.concatenate([slope, ridges], axis=1))
        right = np.concatenate([gap, np.zeros((len(windows), len(free)))], axis=1)
        step = np.linalg.solve(triangle, basis.transpose(0, 2, 1) @ right[..., None])[..., 0]
        states = states.copy()
        # As far as is allowed, in its own direction: a part of it alone may lead uphill.
        beyond = np.maximum(np.abs(step / limit).max(axis=1), 1.0)
        states[:, free] += step / beyond[:, None]
        # A step that did not help leads nowhere, however far it would go on.
        far = bool((better & (beyond > 1.0)).any())
    return best
