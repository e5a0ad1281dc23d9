"""Channels that are no measurement of their own: sums of a rate, differences of a position."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.logs.faults import grain

Array = NDArray[np.float64]

#: Samples that a comparison needs.
_FEW = 20
#: Samples of a run that are looked at.
_ENOUGH = 100_000
#: Distance from whole steps of a position's grid, in steps, that is none (0.25 is chance).
_WHOLE = 0.05


def summed_up(
    positions: Sequence[Array], rates: Sequence[Array], durations: Sequence[Array]
) -> bool:
    """Whether a channel is nothing but the running sum of another one, noise and all.

    The change of an independent sensor does not contain the noise of the rate; that of a sum
    contains it to the digit, so it cannot be told from the rate by any of the usual rules.

    Args:
        positions: What may be a sum, shape (n,) for each run.
        rates: What may have been summed up, shape (n,).
        durations: From each sample to the next in s, shape (n - 1,).

    Returns:
        True if it is; False also where the rate has too little noise to tell.
    """
    moved = np.concatenate([np.diff(x) for x in positions])
    noise = _noise(rates)
    if not noise:
        return False
    rules = (
        np.concatenate([v[:-1] * h for v, h in zip(rates, durations, strict=True)]),
        np.concatenate([v[1:] * h for v, h in zip(rates, durations, strict=True)]),
        np.concatenate([0.5 * (v[:-1] + v[1:]) * h for v, h in zip(rates, durations, strict=True)]),
    )
    step = float(np.median(np.concatenate(list(durations))))
    lost = []
    for rule in rules:
        off = np.abs(moved - rule)
        off = off[np.isfinite(off)]
        lost.append(float(np.median(off)) / 0.6745 if off.size > 20 else np.inf)
    # Digits that were not printed are lost; fast motion looks like noise, up to some ten times it.
    printed = 0.6 * grain(positions)
    return min(lost) < max(0.01 * noise * step, min(printed, 0.1 * noise * step))


def differenced(
    positions: Sequence[Array], rates: Sequence[Array], durations: Sequence[Array]
) -> bool:
    """Whether a rate was computed from a position, and tells nothing that this does not.

    Such a rate is a weighted sum of the position's changes about the sample, maybe filtered; an
    independent sensor's has noise that they do not hold. A position that is the running sum of
    a rate fits that, too; there the rate was computed only if it moves by whole steps of the
    position's grid.

    Args:
        positions: Shape (n,) for each run.
        rates: What may be its differences, shape (n,).
        durations: From each sample to the next in s, shape (n - 1,).

    Returns:
        True if it was; False also where the rate has too little noise to tell.
    """
    noise = _noise(rates)
    if not noise:
        return False
    rows, aims = [], []
    for whole in zip(positions, rates, durations, strict=True):
        x, v, h = whole[0][:_ENOUGH], whole[1][:_ENOUGH], whole[2][: _ENOUGH - 1]
        if len(x) > 4:
            d = np.diff(x) / h
            rows.append(np.stack([d[:-3], d[1:-2], d[2:-1], d[3:], v[1:-3]], axis=1))
            aims.append(v[2:-2])
    if not rows:
        return False
    matrix, aim = np.concatenate(rows), np.concatenate(aims)
    known = np.isfinite(matrix).all(axis=1) & np.isfinite(aim)
    if known.sum() < 2 * _FEW:
        return False
    matrix, aim = matrix[known], aim[known]
    weights = np.linalg.lstsq(matrix, aim, rcond=None)[0]
    left = float(np.median(np.abs(aim - matrix @ weights))) / 0.6745
    printed = 0.6 * max(grain(rates), _last_digit(rates))
    if left >= max(0.01 * noise, min(printed, 0.1 * noise)):
        return False
    if not summed_up(positions, rates, durations):
        return True
    grid = grain(positions)
    if not grid:
        return False
    steps = np.concatenate([v[:-1] * h / grid for v, h in zip(rates, durations, strict=True)])
    steps = steps[np.isfinite(steps)]
    return float(np.median(np.abs(steps - np.round(steps)))) < _WHOLE


def _noise(rates: Sequence[Array]) -> float:
    """Standard deviation of the noise of a rate; 0 if there is too little to tell."""
    bends = np.concatenate([np.diff(v, 3) for v in rates])
    speeds = np.concatenate(list(rates))
    bends, speeds = bends[np.isfinite(bends)], speeds[np.isfinite(speeds)]
    if bends.size < _FEW:
        return 0.0
    # Third differences of white noise have 20 times its variance.
    noise = float(np.median(np.abs(bends))) / (0.6745 * np.sqrt(20))
    return noise if noise >= 1e-3 * float(np.std(speeds)) else 0.0


def _last_digit(runs: Sequence[Array]) -> float:
    """The decimal place to which values were printed; 0 if there are too many."""
    values = np.concatenate(list(runs))
    values = values[np.isfinite(values)]
    for place in range(10):
        digits = values * 10.0**place
        if (np.abs(digits - np.round(digits)) < 1e-6 * np.maximum(1.0, np.abs(digits))).all():
            return 10.0**-place
    return 0.0
