"""Least squares from normal equations, every unknown within its bounds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

Array = NDArray[np.float64]


def bounded_step(
    matrix: Array, right: Array, low: Array, high: Array, damping: float = 1e-6
) -> Array:
    """Least squares step, (p,), the best within the bounds.

    Source: Stark and Parker, "Bounded-variable least-squares", Computational Statistics 10 (1995),
    as in SciPy, for where a bound holds some of the unknowns.

    Args:
        matrix, right: Normal equations, (p, p) and (p,).
        low, high: Bounds of the step, (p,); an unknown with equal ones stays there.
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
        free = least < most
        step = np.where(free, 0.0, least)
        right = (right - matrix @ step)[free]
        if free.any():
            factor = np.linalg.cholesky(matrix[np.ix_(free, free)])
            aim, bounds = np.linalg.solve(factor, right), (least[free], most[free])
            with np.errstate(over="ignore", invalid="ignore"):  # of a trial that ran away
                step[free] = lsq_linear(factor.T, aim, bounds, method="bvls").x
    return np.clip(step / size, low, high)
