"""How wide the intervals of a Gaussian process should be, by leaving out neighbourhoods.

A policy goes where no data are. Likelihood fits the spread between neighbouring rows, so the
spread farther out is checked by leaving out whole neighbourhoods of rows, and scaled until
intervals of 90 % cover 90 %.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, lapack
from scipy.optimize import brentq
from sklearn.cluster import KMeans

from residual.estimator import Array

FOLDS = 20
#: Fewer rows say nothing about neighbourhoods.
FEWEST_ROWS = 5 * FOLDS
#: Coverage this close to 90 % is left as it is: a few dozen neighbourhoods tell no better.
_TOLERANCE = 0.03
_MOST = 4.0
NINETY_PERCENT = 1.6449  # two-sided quantile of the normal distribution


def neighbourhoods(X: Array, random: np.random.RandomState) -> list[NDArray[np.intp]]:
    """Rows of ``X``, shape (n, n_in), parted into ``FOLDS`` clusters; each as row numbers."""
    means = KMeans(FOLDS, n_init=1, max_iter=20, random_state=random)
    labels = means.fit_predict(X)
    return [rows for fold in range(FOLDS) if len(rows := np.flatnonzero(labels == fold))]


def left_out(factor: Array, weights: Array, folds: list[NDArray[np.intp]]) -> tuple[Array, Array]:
    """What a process would have said of every row without the rows of its fold.

    With the inverse P of the kernel matrix, noise included, the errors of the rows B left out
    are (P_BB)^-1 w_B for w = P y, and their covariance is (P_BB)^-1: the block form of
    Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006, section 5.4.2.

    Args:
        factor: Lower Cholesky factor of the kernel matrix, shape (n, n).
        weights: P y, shape (n,).
        folds: Row numbers of each fold.

    Returns:
        Errors and their predicted variances, noise included, shape (n,) each, fold by fold.
    """
    inverse, _ = lapack.dpotri(factor, lower=1)  # its lower triangle
    errors, variances = [], []
    for rows in folds:
        block = cho_factor(inverse[np.ix_(rows, rows)], lower=True, check_finite=False)
        errors.append(cho_solve(block, weights[rows], check_finite=False))
        variances.append(np.diag(cho_solve(block, np.eye(len(rows)), check_finite=False)))
    return np.concatenate(errors), np.concatenate(variances)


def spread_factor(errors: Array, variances: Array, noise: float) -> float:
    """Factor of the noise-free standard deviation with which 90 % intervals cover 90 %.

    Args:
        errors: Errors of predictions, shape (n,).
        variances: Their predicted variances without observation noise, shape (n,).
        noise: Variance of the observation noise, which is not scaled.

    Returns:
        The factor, between 1/4 and 4; 1 if the intervals are right already.
    """

    def excess(logarithm: float) -> float:
        spread = np.sqrt(np.exp(2 * logarithm) * variances + noise)
        return float(np.mean(np.abs(errors) <= NINETY_PERCENT * spread)) - 0.9

    if abs(excess(0.0)) <= _TOLERANCE:
        return 1.0
    low, high = -np.log(_MOST), np.log(_MOST)
    if excess(low) >= 0:
        return 1 / _MOST
    if excess(high) <= 0:
        return _MOST
    return float(np.exp(brentq(excess, low, high, xtol=1e-3)))
