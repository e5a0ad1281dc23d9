"""Least squares from normal equations, every unknown within its bounds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Passes over all unknowns where a bound holds some of them.
PASSES = 200


def bounded_step(
    matrix: Array, right: Array, low: Array, high: Array, damping: float = 1e-6
) -> Array:
    """Least squares step, (p,), the best within the bounds.

    Args:
        matrix, right: Normal equations, (p, p) and (p,).
        low, high: Bounds of the step.
        damping: Added to the diagonal of the scaled matrix.

    Returns:
        The step; none where the equations have overflowed, as of a trial that runs away.
    """
    p = len(right)
    if not (np.isfinite(matrix).all() and np.isfinite(right).all()):
        return np.zeros(p)
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    matrix = matrix / np.outer(size, size) + damping * np.eye(p)
    right, least, most = right / size, low * size, high * size
    step = np.linalg.lstsq(matrix, right, rcond=None)[0]
    if ((step < least) | (step > most)).any():
        step = np.clip(step, least, most)
        # One unknown after the other: the problem is convex, so this ends at its least value.
        for _ in range(PASSES):
            before = step.copy()
            for i in range(p):
                rest = right[i] - matrix[i] @ step + matrix[i, i] * step[i]
                step[i] = min(max(rest / matrix[i, i], least[i]), most[i])
            if np.abs(step - before).max() <= 1e-9 * np.abs(step).max():
                break
    return np.clip(step / size, low, high)
