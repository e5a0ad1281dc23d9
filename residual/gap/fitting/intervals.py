"""How well fitted numbers are known."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t

from residual.gap.data.blocks import Blocks
from residual.gap.fitting.contract import Fit
from residual.gap.result import Number

Array = NDArray[np.float64]


def at_bound(fit: Fit, j: int) -> bool:
    """Whether a number lies at its bound."""
    knob, value = fit.model.knobs[j], float(fit.theta[j])
    close = 1e-6 * max(abs(value), 1e-3 * knob.step)
    return bool(abs(value - knob.low) <= close or abs(value - knob.high) <= close)


def ended(fit: Fit, j: int) -> bool:
    """Whether a number lies at its bound, or so far that nothing depends on it any longer.

    Where the simulator itself cuts off what the number changes, such as a wind that cannot be less
    than none, any further number does as well: no interval would mean anything there either.
    """
    return at_bound(fit, j) or not fit.by_knob[..., j].any()


def bounded(fit: Fit, j: int, half: float, numerics: Sequence[Array]) -> Number:
    """A number with its interval, widened to what half the step makes of it."""
    knob, value = fit.model.knobs[j], float(fit.theta[j])
    fine = float(numerics[0][j]) if len(numerics) else value
    low, high = min(value, fine) - half, max(value, fine) + half
    return Number(value, max(low, knob.low), min(high, knob.high), knob.unit, ended(fit, j))


def deviations(fit: Fit, blocks: Blocks) -> Array:
    """Standard deviation of the numbers, (p,): the larger of two.

    One is Gauss-Newton's with start states projected out, times the residual variance; the other
    the sandwich over blocks, which allows for errors that go together within a block, with
    Student's t for few blocks. Source: White, "Maximum likelihood estimation of misspecified
    models", Econometrica 50 (1982). What is known of a number beforehand counts as an observation,
    and is known as well however large the residuals are.
    """
    p = len(fit.theta)
    if not p:
        return np.zeros(0)
    root = np.sqrt(fit.weights)[:, None]
    rows, residual = fit.by_knob * root[..., None], fit.projected * root
    scale = np.sqrt(np.maximum((rows**2).sum(axis=(0, 1)), 1e-300))
    unit = rows / scale
    # Of a number that moves nothing, no more is known than what is known for certain.
    known = np.maximum(np.array([knob.known for knob in fit.model.knobs]) * scale, 1e-6)
    matrix, prior = np.einsum("wri,wrj->ij", unit, unit), np.diag(known**-2)
    freedom = int((np.abs(residual) > 0).sum()) - fit.basis.shape[2] * len(residual)
    variance = 1.0
    for _ in range(2):
        inverse = np.linalg.pinv(matrix + variance * prior, rcond=1e-12)
        # A number that is known beforehand takes less of the data than a whole one.
        taken = float(np.clip(1 - variance * np.diag(inverse) * known**-2, 0.0, 1.0).sum())
        variance = max(1.0, float((residual**2).sum()) / max(freedom - taken, 1))
    plain = variance * np.maximum(np.diag(inverse), 0.0)  # of a matrix that is all but singular
    count = len(blocks)
    if count <= taken + 1:
        return np.sqrt(plain) / scale
    per_window = np.einsum("wri,wr->wi", unit, residual)
    scores = np.stack([per_window[blocks.block == b].sum(axis=0) for b in range(count)])
    meat = scores.T @ scores * count / (count - taken)
    # Errors that go together count for more, so that less is left to say of what is known.
    variance = max(variance, float(np.diag(meat).mean()))
    inverse = np.linalg.pinv(matrix + variance * prior, rcond=1e-12)
    sandwich = np.diag(inverse @ (meat + variance**2 * prior) @ inverse)
    return np.sqrt(np.maximum(plain, sandwich)) * _student(count - taken) / scale


def _student(freedom: float) -> float:
    """Student's 95 % quantile over the normal one."""
    return float(t.ppf(0.975, freedom) / 1.96)
