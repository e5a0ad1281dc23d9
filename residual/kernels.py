"""Kernels of Gaussian processes, and the noise of one that a few points summarise."""

from __future__ import annotations

from typing import Literal

import numpy as np

from residual.estimator import Array
from residual.likelihood import BOUNDS

Kernel = Literal["rbf", "matern"]
KERNELS = ("rbf", "matern")


def covariance(a: Array, b: Array, lengthscale: Array, outputscale: float, kernel: Kernel) -> Array:
    """Covariances between rows a and rows b, shape (len(a), len(b))."""
    a, b = a / lengthscale, b / lengthscale
    matrix = a @ b.T
    matrix *= -2
    matrix += np.sum(a**2, axis=1)[:, None]
    matrix += np.sum(b**2, axis=1)
    return outputscale * correlation(matrix, kernel)


def correlation(squared: Array, kernel: Kernel) -> Array:
    """Correlation at a squared scaled distance, in place; ``"matern"`` is of smoothness 5/2."""
    if kernel == "rbf":
        squared *= -0.5
        return np.exp(np.minimum(squared, 0, out=squared), out=squared)
    squared *= 5
    root = np.sqrt(np.maximum(squared, 0, out=squared))
    return (1 + root + squared / 3) * np.exp(-root)


def best_noise(gram: Array, moment: Array, energy: float, lost: float, rows: int) -> float:
    """Noise variance that maximises Titsias' bound, by a fine logarithmic grid.

    Args:
        gram: A A^T with A = L^-1 K(points, rows), K(points) = L L^T, shape (m, m).
        moment: A y, shape (m,).
        energy: y^T y.
        lost: trace of what the points do not explain of K(rows).
        rows: Number of rows.
    """
    eigenvalues, vectors = np.linalg.eigh(gram)
    eigenvalues = np.maximum(eigenvalues, 0)
    projected = vectors.T @ moment
    grid = np.geomspace(*BOUNDS["noise"], 201)
    inverse = 1 / (eigenvalues + grid[:, None])
    misfit = np.maximum(energy - inverse @ projected**2, 1e-14 * energy)
    volume = np.sum(np.log1p(eigenvalues / grid[:, None]), axis=1) + rows * np.log(grid)
    return float(grid[np.argmin(volume + (misfit + lost) / grid)])
