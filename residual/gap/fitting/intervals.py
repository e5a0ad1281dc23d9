"""How well fitted numbers are known."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from residual.gap.data.blocks import Blocks
from residual.gap.fitting.contract import Fit
from residual.gap.result import Number

Array = NDArray[np.float64]

#: Part of what tells of a number that one block may hold, if it is to be left out.
MOST = 0.9
#: Fewest degrees of freedom of Student's t.
FEWEST = 3.0


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


def cut_off(fit: Fit, j: int) -> bool:
    """Whether a number ended where the data would have it go on: not at a bound at which its effect
    is a law of its own, as thrust by the square of a command alone is."""
    effect = fit.model.chosen[int(fit.model.owner[j])].effect
    knob = fit.model.knobs[j]
    whole = knob.field in effect.whole and float(fit.theta[j]) > 0.5 * (knob.low + knob.high)
    return ended(fit, j) and not whole


def bounded(fit: Fit, j: int, half: float, numerics: Sequence[Array]) -> Number:
    """A number with its interval, widened to what half the step makes of it."""
    knob, value = fit.model.knobs[j], float(fit.theta[j])
    fine = float(numerics[0][j]) if len(numerics) else value
    low, high = min(value, fine) - half, max(value, fine) + half
    return Number(value, max(low, knob.low), min(high, knob.high), knob.unit, ended(fit, j))


def deviations(fit: Fit, blocks: Blocks) -> Array:
    """Standard deviation of the numbers, (p,), by slopes and by the profile of the loss."""
    by_slopes = _by_slopes(fit, blocks)
    return by_slopes if fit.spread is None else np.maximum(by_slopes, fit.spread)


def scatter(fit: Fit, blocks: Blocks) -> Array:
    """How many times as much the numbers scatter from block to block as residuals of the size that
    is left make them, (p,); one where the model is right and residuals are noise.

    Source: White, "Maximum likelihood estimation of misspecified models", Econometrica 50 (1982):
    of a wrong model the two ways to tell how well a number is known differ.
    """
    if not len(fit.theta):
        return np.zeros(0)
    plain, jackknife, _ = _spreads(fit, blocks)
    with np.errstate(over="ignore"):  # what the data hardly tell of scatters without end
        return np.asarray(jackknife / np.maximum(plain, 1e-300))


def _by_slopes(fit: Fit, blocks: Blocks) -> Array:
    """Standard deviation of the numbers, (p,): the larger one of ``_spreads``, with Student's t for
    as many blocks as tell of a number."""
    if not len(fit.theta):
        return np.zeros(0)
    plain, jackknife, telling = _spreads(fit, blocks)
    return np.maximum(plain, jackknife) * _student(telling)


def _spreads(fit: Fit, blocks: Blocks) -> tuple[Array, Array, Array]:
    """Two standard deviations of the numbers, (p,) each, and how many blocks tell of each.

    One is Gauss-Newton's with start states projected out, times the residual variance; the other
    is of the numbers that data without one of the blocks would give, which allows for errors that
    go together within a block, zero of too few. What is known of a number beforehand counts as an
    observation, and is known as well however large the residuals are. A fit that ran away tells
    nothing.

    Sources: MacKinnon, Nielsen and Webb, "Fast and reliable jackknife and bootstrap methods for
    cluster-robust inference", J. Applied Econometrics 38 (2023); for the number of blocks Carter,
    Schnepel and Steigerwald, "Asymptotic behavior of a t-test robust to cluster heterogeneity",
    Review of Economics and Statistics 99 (2017).
    """
    told = fit.told
    rows, residual = told.by_knob, told.residual
    with np.errstate(over="ignore"):
        squares, slopes = float((residual**2).sum()), (rows**2).sum(axis=(0, 1))
    if not np.isfinite([squares, *slopes]).all():
        unknown = np.full(rows.shape[-1], np.inf)
        return unknown, unknown, unknown
    scale = np.sqrt(np.maximum(slopes, 1e-300))
    unit = rows / scale
    # Of a number that moves nothing, no more is known than what is known for certain.
    known = np.maximum(np.array([knob.known for knob in fit.model.knobs]) * scale, 1e-6)
    each, prior = np.einsum("wri,wrj->wij", unit, unit), np.diag(known**-2)
    matrix = each.sum(axis=0)
    freedom = int((np.abs(residual) > 0).sum()) - told.taken * len(residual)
    variance = 1.0
    for _ in range(2):
        inverse = np.linalg.pinv(matrix + variance * prior, rcond=1e-12)
        # A number that is known beforehand takes less of the data than a whole one.
        taken = float(np.clip(1 - variance * np.diag(inverse) * known**-2, 0.0, 1.0).sum())
        variance = max(1.0, squares / max(freedom - taken, 1))
    plain = variance * np.maximum(np.diag(inverse), 0.0)  # of a matrix that is all but singular
    count = len(blocks)
    if count <= taken + 1:
        return np.sqrt(plain) / scale, 0.0 * plain, np.full(len(plain), np.inf)
    per_window = np.einsum("wri,wr->wi", unit, residual)
    scores = np.stack([per_window[blocks.block == b].sum(axis=0) for b in range(count)])
    own = np.stack([each[blocks.block == b].sum(axis=0) for b in range(count)])
    # Errors that go together count for more, so that less is left to say of what is known.
    meat = scores.T @ scores * count / (count - taken)
    variance = max(variance, float(np.diag(meat).mean()))
    inverse = np.linalg.pinv(matrix + variance * prior, rcond=1e-12)
    moved = _without_each(inverse, own, scores)
    jackknife = (count - 1) / count * (moved**2).sum(axis=0)
    jackknife += variance**2 * np.einsum("ji,ik,kj->j", inverse, prior, inverse)
    return np.sqrt(plain) / scale, np.sqrt(jackknife) / scale, _telling(inverse, own)


def _without_each(inverse: Array, own: Array, scores: Array) -> Array:
    """How far the numbers move if one block is left out, (B, p).

    Args:
        inverse: Of the normal matrix, (p, p).
        own: What every block adds to that matrix, (B, p, p).
        scores: Slopes times residuals of every block, (B, p).
    """
    values, axes = np.linalg.eigh(inverse)
    root = axes * np.sqrt(np.maximum(values, 0.0))
    share, ways = np.linalg.eigh(root.T @ own @ root)
    along = np.einsum("bij,bi->bj", ways, scores @ root)
    along /= 1 - np.minimum(share, MOST)
    return np.einsum("bij,bj->bi", ways, along) @ root.T


def _telling(inverse: Array, own: Array) -> Array:
    """How many equal blocks would tell as much of each number as these unequal ones do, (p,)."""
    parts = np.einsum("ji,bik,kj->bj", inverse, own, inverse)
    return np.asarray(parts.sum(axis=0) ** 2 / np.maximum((parts**2).sum(axis=0), 1e-300))


def _student(blocks: Array) -> Array:
    """Student's 95 % quantile over the normal one."""
    return np.asarray(stdtrit(np.maximum(blocks - 1, FEWEST), 0.975) / 1.96)
