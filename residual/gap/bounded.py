"""Least squares from normal equations, every unknown within its bounds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def bounded_step(
    matrix: Array, right: Array, low: Array, high: Array, damping: float = 1e-6
) -> Array:
    """Least squares step, (p,): what would leave the bounds is held there, the rest solved again.

    Args:
        matrix, right: Normal equations, (p, p) and (p,).
        low, high: Bounds of the step.
        damping: Added to the diagonal of the scaled matrix.
    """
    p = len(right)
    step = np.zeros(p)
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    matrix = matrix / np.outer(size, size) + damping * np.eye(p)
    right = right / size
    held = np.zeros(p, bool)
    for _ in range(p + 1):
        loose = ~held
        if not loose.any():
            break
        shift = right[loose] - matrix[np.ix_(loose, held)] @ (step[held] * size[held])
        step[loose] = (
            np.linalg.lstsq(matrix[np.ix_(loose, loose)], shift, rcond=None)[0] / size[loose]
        )
        out = loose & ((step < low) | (step > high))
        if not out.any():
            break
        step[out] = np.clip(step[out], low[out], high[out])
        held |= out
    return np.clip(step, low, high)
