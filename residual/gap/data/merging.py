"""Inputs of several recorded intervals as one row's: mean and rise in each of its sub-steps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Part of the usual interval of a row by which others may differ and still count alike.
EVEN = 0.2


def merged(driven: Array, durations: Array, count: int) -> Array:
    """Inputs in ``count`` equal sub-steps of every row, with the integral and the first moment that
    the recorded intervals have in them.

    Args:
        driven: Mean and rise in every sub-step of the recorded intervals, (V, rows, s, n_a, 2).
        durations: Of the recorded intervals, each of as many sub-steps, (rows, intervals); of a
            row that has fewer, the others take no time.
        count: Sub-steps of a row.

    Returns:
        (V, rows, count, n_a, 2).
    """
    total = driven.shape[2]
    uneven = np.ptp(durations, axis=1) > EVEN * durations.mean(axis=1)
    found = _alike(driven, total // count)
    if uneven.any():
        steps = np.repeat(durations[uneven], total // durations.shape[1], axis=1)
        found[:, uneven] = _by_time(driven[:, uneven], steps, count)
    return found


def _alike(driven: Array, each: int) -> Array:
    """Every ``each`` sub-steps as one."""
    if each == 1:
        return driven.copy()
    variants, rows, total, inputs, _ = driven.shape
    parts = driven.reshape(variants, rows, total // each, each, inputs, 2)
    place = (np.arange(each) - 0.5 * (each - 1))[:, None]
    mean = parts[..., 0].mean(axis=3)
    rise = (12 * (parts[..., 0] * place).sum(axis=3) + parts[..., 1].sum(axis=3)) / each**2
    return np.stack([mean, rise], axis=-1)


def _by_time(driven: Array, durations: Array, count: int) -> Array:
    """The same where sub-steps take unlike times, which are counted in those of their row."""
    width = durations / durations.sum(axis=1, keepdims=True)
    end = np.cumsum(width, axis=1)
    middle = end - 0.5 * width
    edges = np.arange(count + 1) / count
    # What lies of each sub-step (rows, s) before each edge: up to x, begun at ``begin``.
    begin = (end - width)[..., None]
    x = np.clip(edges, begin, end[..., None])
    wide = np.maximum(width, np.finfo(float).tiny)[..., None]  # those without width hold nothing
    slant = ((x - middle[..., None]) ** 2 - (0.5 * width[..., None]) ** 2) / (2 * wide)
    cubes = (x**3 - begin**3) / 3 - middle[..., None] * (x**2 - begin**2) / 2
    mean, rise = driven[..., 0], driven[..., 1]

    def before(of_mean: Array, of_rise: Array) -> Array:
        by_mean = np.einsum("vrsn,rse->vren", mean, of_mean)
        return by_mean + np.einsum("vrsn,rse->vren", rise, of_rise)

    area = np.diff(before(x - begin, slant), axis=2)
    moment = np.diff(before((x**2 - begin**2) / 2, cubes / wide), axis=2)
    centre = (np.arange(count) + 0.5)[:, None] / count
    return np.stack([area * count, 12 * (moment - centre * area) * count**2], axis=-1)
