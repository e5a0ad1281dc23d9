"""Sensors that froze: repeats of one value that no rest explains."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from residual.logs.faults import RARE, WILD, in_full_motion, noise, rounding, stretches

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Equal samples in a row that a moving channel does not have by chance.
_STILL = 10
# Part of the samples before that have to differ, and usual changes that make a way, of what moved.
_MOVING, _CLEAR = 0.8, 4.0
# Changes that say how a channel scatters, and the part of them that turn back where it is noise; of
# second differences, to which motion adds less, three quarters do.
_KNOWN, _TURNS, _BENDS = 50, 0.3, 0.6
# Noise by steps of rounding from which on readings are hardly ever equal for long, and the odds of
# as many equal ones, once in a whole log.
_SHAKES, _ODDS = 0.6, 1e-6
# A sensor that thaws leaps so many times as far as it moves after that; what breaks away speeds up.
_CATCHES_UP = 2.0
# Missing samples in a row that do not part equal ones.
_HOLE = 2
# Samples before and after a stop at which another sensor would notice it, part of the pace that it
# keeps there where it does not, and at the end of the stop.
_ABOUT, _PACE, _LATE = 5, 0.7, 0.2


def frozen_samples(runs: Sequence[Array], moved: Sequence[Array] | None = None) -> list[Mask]:
    """Repeats of one value where the channel was moving until then.

    A system at rest gives equal samples too, and dry friction stops it at once. A frozen sensor
    does not slow down before, and has to catch up when it thaws, by more than it moves from then
    on, or by what it would have gone meanwhile; if it does not thaw, only another sensor can tell.
    Where samples scatter, more of them in a row than chance makes equal (ten, if two hardly ever
    are) are no rest either, but for those at zero or at an end of the range, where sensors hold
    still.

    Args:
        runs: As for ``wild_samples``.
        moved: What another sensor says of the change from each sample to the next, (n - 1,) for
            each run; the integral of a measured rate, for example.

    Returns:
        True where a value repeats the one before and should not.
    """
    kept = [_without_holes(values) for values in runs]
    others = moved or [np.zeros(max(len(values) - 1, 0)) for values in runs]
    # What another sensor says of the change over a hole is the sum of what it says inside.
    there = [
        np.add.reduceat(other, index[:-1]) if len(index) > 1 else np.zeros(0)
        for other, index in zip(others, kept, strict=True)
    ]
    known = [values[index] for values, index in zip(runs, kept, strict=True)]
    found = [np.zeros(len(values), bool) for values in runs]
    for mask, index, own in zip(found, kept, _frozen(known, there), strict=True):
        mask[index] = own
    return found


def _without_holes(values: Array) -> NDArray[np.intp]:
    """Places of samples, without those that are missing alone, or next to another one."""
    short = np.zeros(len(values), bool)
    missing = np.isnan(values)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], missing, [False]])))
    for first, end in edges.reshape(-1, 2):
        short[first:end] = end - first <= _HOLE and first > 0 and end < len(values)
    return np.flatnonzero(~short)


def _frozen(runs: Sequence[Array], others: Sequence[Array]) -> list[Mask]:
    """``frozen_samples`` of runs without holes."""
    changes = [np.abs(np.diff(values)) for values in runs]
    moving = np.concatenate([change[change > 0] for change in changes] or [np.zeros(0)])
    found = [np.zeros(len(values), bool) for values in runs]
    if not moving.size:
        return found
    typical, step = float(np.median(moving)), rounding(runs)
    known = np.concatenate(list(runs))
    chance, ends = equal_by_chance(runs), (0.0, np.nanmin(known), np.nanmax(known))
    for values, change, other, mask in zip(runs, changes, others, found, strict=True):
        for a, b in stretches(change == 0):  # samples a to b are equal
            if b - a < _STILL or a < 3:
                continue
            if (b - a > chance and values[a] not in ends) or _owed(values, a, b):
                mask[a + 1 : b + 1] = True
                continue
            least = max(WILD * typical, 2.1 * step)
            leap, after = np.abs(np.diff(values[b : b + 3], append=[np.nan, np.nan]))[:2]
            thawed = leap > least and leap > _CATCHES_UP * after > 0.0
            contradicted = float(np.abs(np.nancumsum(other[a:b])).max()) > least
            entry = max(0.3 * typical, 1.5 * step)
            moving_on = contradicted and _goes_on(other, a, b)
            if moving_on or (
                (thawed or contradicted) and in_full_motion(values[a - 3 : a + 1], entry, 1)
            ):
                mask[a + 1 : b + 1] = True
    return found


def _goes_on(moved: Array, a: int, b: int) -> bool:
    """Whether another sensor does not notice that a channel stands still from sample a to b.

    A rate that is filtered is late to notice a stop, but notices it.
    """
    before, after, late = (
        moved[max(0, a - _ABOUT) : a],
        moved[a : a + _ABOUT],
        moved[b - _ABOUT : b],
    )
    if not np.isfinite([*before, *after, *late]).all() or np.ptp(np.sign([*before, *after])):
        return False
    pace = float(np.abs(before).mean())
    return bool(np.abs(after).mean() > _PACE * pace > 0.0 and np.abs(late).mean() > _LATE * pace)


def _owed(values: Array, a: int, b: int) -> bool:
    """Whether what a channel leaps after equal samples a to b is what it would have gone meanwhile,
    at the pace of as many samples before, with noise or without.

    What stuck begins again at the pace of one sample, and what is wild comes back.
    """
    if a < _STILL or b + 1 >= len(values):
        return False
    before = np.diff(values[max(0, 2 * a - b) : a + 1])
    if not np.isfinite(before).all() or np.mean(before != 0) < _MOVING:
        return False
    pace, usual = float(before.mean()), float(np.median(np.abs(before)))
    gone, leap = pace * (b - a + 1), float(values[b + 1] - values[b])
    clear = min(abs(gone), abs(leap)) > _CLEAR * usual
    if abs(float(values[min(b + 2, len(values) - 1)] - values[b])) < 0.5 * abs(leap):
        return False  # a single wild reading, after which it rests on
    return bool(clear and 0.5 < leap / gone < 2.0)


def equal_by_chance(runs: Sequence[Array]) -> float:
    """How many readings in a row may be equal where they scatter; infinite where they do not."""
    step = rounding(runs)
    changes = [np.diff(values) for values in runs]
    for change in changes:
        for a, b in stretches(change == 0):
            if b - a >= _STILL:
                change[a:b] = np.nan
    loose = np.concatenate(changes)
    loose = loose[np.isfinite(loose)]
    pairs = loose[1:] * loose[:-1]
    pairs = pairs[pairs != 0.0]
    if len(loose) < _KNOWN or len(pairs) < _KNOWN / 2:
        return np.inf
    equal = float(np.mean(loose == 0))
    if np.mean(pairs < 0) < _TURNS:
        return _STILL - 1 if equal <= RARE and _shakes(runs, changes, step) else np.inf
    if equal <= RARE:
        return _STILL - 1
    if not step:
        return np.inf
    # Noise, rounding apart: of second differences it makes six times its variance, and readings
    # are equal less often the larger it is. Motion adds to both, so the lesser counts.
    bends = np.concatenate([np.diff(change) for change in changes])
    variance = float(np.nanmean(bends**2)) / 6 - step**2 / 12
    sigma = min(np.sqrt(max(0.0, variance)), step / (2 * np.sqrt(np.pi) * equal))
    if sigma < _SHAKES * step:
        return np.inf
    # They are most often so if what is measured lies in the middle of a step.
    shares = np.diff(ndtr((np.arange(-20, 21) - 0.5) * step / sigma))
    return float(np.log(_ODDS / len(loose)) / np.log(np.sum(shares**2)))


def _shakes(runs: Sequence[Array], changes: Sequence[Array], step: float) -> bool:
    """Whether readings that mostly move shake as well, by more than rounding makes of motion."""
    bends = [np.diff(change) for change in changes]
    pairs = np.concatenate([bend[1:] * bend[:-1] for bend in bends])
    pairs = pairs[np.isfinite(pairs)]
    if len(pairs) < _KNOWN or np.mean(pairs < 0) < _BENDS:
        return False
    return noise(runs) ** 2 - step**2 / 12 > (_SHAKES * step) ** 2
