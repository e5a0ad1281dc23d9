"""Cross-validation: forecasts of every block by numbers that were fitted without its fold."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.blocks import Blocks
from residual.gap.fitting.bounded import bounded_step
from residual.gap.fitting.contract import Fit, Fitter, Foretold

Array = NDArray[np.float64]

#: Squared change of all residuals by a usual step of a number, below which it is not fitted.
IDLE = 1e-4


@dataclasses.dataclass(frozen=True)
class Validated:
    """A fitted set of effects, and its forecasts of data that did not fit its numbers.

    Attributes:
        fit: The fit to all folds.
        thetas: Numbers without each fold, (K, p).
        squares: Mean squared forecast error of every block and measured channel, (B, m).
        half: The same over the first half of the horizon.
        foretold: The forecasts.
    """

    fit: Fit
    thetas: Array
    squares: Array
    half: Array
    foretold: Foretold


def validate(fitter: Fitter, fit: Fit) -> Validated:
    """Forecast every block by the numbers without its fold."""
    blocks = fitter.blocks
    thetas = without_folds(fit, blocks)
    foretold = fitter.foretell(fit.model, thetas, blocks.fold_of_window, fit)
    return Validated(
        fit, thetas, by_block(foretold.squares, blocks), by_block(foretold.half, blocks), foretold
    )


def without_folds(fit: Fit, blocks: Blocks) -> Array:
    """Numbers fitted without each fold, (K, p): one Gauss-Newton step from those of all."""
    told = fit.told
    matrices = np.einsum("wri,wrj->wij", told.by_knob, told.by_knob)
    rights = np.einsum("wri,wr->wi", told.by_knob, told.residual)
    model, theta = fit.model, fit.theta
    found = np.repeat(theta[None], blocks.folds, axis=0)
    if not len(theta) or blocks.folds < 2:
        return found
    low, high = model.room(theta)
    for fold in range(blocks.folds):
        rest = blocks.fold_of_window != fold
        matrix, right = matrices[rest].sum(axis=0), rights[rest].sum(axis=0)
        # A number of which the other folds tell nothing stays where all of them put it.
        told = np.diag(matrix) * model.step**2 > IDLE
        found[fold] += bounded_step(
            matrix, right, np.where(told, low, 0.0), np.where(told, high, 0.0)
        )
    return found


def by_block(squares: Array, blocks: Blocks) -> Array:
    """Mean over the windows of every block, (W, m) -> (B, m)."""
    found = np.full((len(blocks), squares.shape[1]), np.nan)
    for number in range(len(blocks)):
        own = squares[blocks.block == number]
        there = np.isfinite(own)
        total = np.where(there, own, 0.0).sum(axis=0)
        found[number] = np.where(
            there.any(axis=0), total / np.maximum(there.sum(axis=0), 1), np.nan
        )
    return found
