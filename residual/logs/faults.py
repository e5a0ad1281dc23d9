"""Faults of sensors that show in the numbers of one channel alone.

Each test looks at all runs of a channel, since one run may hold too little of what is usual. All
are made so that noise, rounding, rest and sudden pushes are no faults.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# A sample is wild if it leaves its neighbours, and comes back, by so many times what nearly all
# changes between samples reach.
WILD = 8.0
# Or if the path through its neighbours is smooth: it leaves that by so many times what samples
# usually do, and its neighbours by so many times what those differ from the next ones.
_OFF_PATH, _ALONE = 20.0, 3.0
# More of them than this share are noise with heavy tails, no accidents.
RARE = 0.01
# But so many may be accidents in a short log, up to that share of it.
_ACCIDENTS, _OF_SHORT = 3, 0.03
# But none reaches out of nine tenths of all samples by so many times their range, in up to so many.
_ABSURD, _SOME = 100.0, 0.1
# Part of the samples that are one step on, where the sensor's steps made the samples.
_STEPPED = 0.9
# Share of the range of values above which a step of rounding is worth a word.
_COARSE = 3e-4
# Values of a channel that may as well be all that it has.
_FEW_VALUES = 8
# Zeros in a row that are a drop-out rather than a time at which nothing happened.
_LONGEST_DROP = 50
# Readings of which a few values are all that the sensor tells.
MANY = 100
# Part of the least distance of two values that their common step is at least.
_PARTS = 0.15


def wild_samples(runs: Sequence[Array]) -> list[Mask]:
    """Single samples far from both neighbours, which agree with each other.

    Args:
        runs: Values of one channel, NaN where missing, shape (n,) each.

    Returns:
        True where a sample is wild; nowhere if there are too many for accidents.
    """
    usual, step, off = _usual_change(runs), rounding(runs), _usual_departure(runs)
    found = []
    for values in runs:
        mask = np.zeros(len(values), bool)
        if len(values) > 2:
            moves = np.diff(values)
            before, after = moves[:-1], moves[1:]
            least = np.minimum(np.abs(before), np.abs(after))
            # What the neighbours differ from theirs; at the ends that is not known.
            around = np.abs(np.concatenate([[np.inf], moves, [np.inf]]))
            near = np.fmax(around[:-3], around[3:])
            with np.errstate(invalid="ignore"):
                alone = (least > _ALONE * near) & (least > _OFF_PATH * max(off, step))
                mask[1:-1] = (
                    (before * after < 0)
                    & ((least > WILD * max(usual, step)) | alone)
                    & (np.abs(before + after) < 0.3 * least)
                )
        found.append(mask)
    samples, wild = sum(map(len, found)), sum(int(mask.sum()) for mask in found)
    if wild <= max(RARE * samples, min(_ACCIDENTS, _OF_SHORT * samples)):
        return found
    absurd = [mask & far for mask, far in zip(found, _absurd(runs), strict=True)]
    return absurd if _share(absurd) <= _SOME else [np.zeros(len(own), bool) for own in runs]


def _share(masks: Sequence[Mask]) -> float:
    return sum(int(mask.sum()) for mask in masks) / max(1, sum(map(len, masks)))


def _absurd(runs: Sequence[Array]) -> list[Mask]:
    """Values that lie out of what nine in ten are by a hundred times their range."""
    low, high = np.nanquantile(np.concatenate(list(runs)), [0.05, 0.95])
    reach = _ABSURD * (high - low)
    if not reach > 0:
        return [np.zeros(len(values), bool) for values in runs]
    return [(values > high + reach) | (values < low - reach) for values in runs]


def dropped_samples(runs: Sequence[Array], turn: float = 0.0) -> list[Mask]:
    """What stands in a log for a reading that was not received: exact zeros in the middle of values
    far from zero, or one other value beyond all that was measured, exactly the same each time.

    Args:
        runs: As for ``wild_samples``.
        turn: What one turn measures, for an angle that was unwrapped; multiples of it are zeros.

    Returns:
        True where a sample is such a value that was jumped to and jumped from.
    """
    known = np.concatenate([values[np.isfinite(values)] for values in runs] or [np.zeros(0)])
    if len(np.unique(known)) < _FEW_VALUES:
        # What knows few values, such as a valve that is open or closed, jumps between them.
        return [np.zeros(len(values), bool) for values in runs]
    rest = [v - turn * np.round(v / turn) if turn else v for v in runs]
    zeros = [np.abs(own) <= 1e-12 * max(1.0, turn) for own in rest]
    found = [mask for mask, _ in _jumped_to(runs, rest, zeros)]
    if turn:
        return found
    for end in {float(known.min()), float(known.max())} - {0.0}:
        masks = _jumped_to(runs, [v - end for v in runs], [v == end for v in runs])
        # A peak may be reached twice; nothing but a stand-in is always jumped to.
        if sum(times for _, times in masks) > 1 and all(
            mask.sum() == (values == end).sum()
            for (mask, _), values in zip(masks, runs, strict=True)
        ):
            found = [mask | its for mask, (its, _) in zip(found, masks, strict=True)]
    return found


def _jumped_to(
    runs: Sequence[Array], rest: Sequence[Array], there: Sequence[Mask]
) -> list[tuple[Mask, int]]:
    """Samples at a value that was jumped to and from, and how often, by run.

    Args:
        runs: As for ``wild_samples``.
        rest: Distances from the value.
        there: Where samples are at it.
    """
    # Jumps to and from it are not what is usual.
    others = [values[~mask] for values, mask in zip(runs, there, strict=True)]
    usual = max(_usual_change(others), rounding(others))
    found = []
    for values, far, at in zip(runs, rest, there, strict=True):
        mask, times = np.zeros(len(values), bool), 0
        for a, b in stretches(at):
            if a == 0 or b == len(values) or b - a > _LONGEST_DROP:
                continue
            least = min(abs(far[a - 1]), abs(far[b]))
            # What comes back elsewhere, or crosses it on its way, is motion.
            same = abs(values[a - 1] - values[b]) < 0.5 * least
            mask[a:b] = same and least > WILD * usual
            times += bool(mask[a])
        found.append((mask, times))
    return found


def in_full_motion(values: Array, least: float, steps: int) -> bool:
    """Whether four samples go one way, by ``least`` on average, and would for some steps more.

    Dry friction slows down evenly before it stops, a sensor that fails does not.
    """
    moves = np.diff(values)
    if len(moves) != 3 or not np.isfinite(moves).all() or np.ptp(np.sign(moves)):
        return False
    first, _, last = speeds = np.abs(moves)
    ahead = last + min(0.0, steps * (last - first) / 2)
    return bool(speeds.mean() > least and ahead > speeds.mean() / 4)


def rounding(runs: Sequence[Array]) -> float:
    """The step to which values were rounded, if it is coarse.

    Returns:
        The step, or 0 if there is none, or one too fine to matter, and where every sample is one
        step on: such samples were taken when the sensor stepped.
    """
    values = np.concatenate([np.ravel(v) for v in runs] or [np.zeros(0)])
    values = values[np.isfinite(values)]
    step = grain(runs)
    moves = np.abs(np.concatenate([np.diff(v) for v in runs] or [np.zeros(0)]))
    moves = moves[np.isfinite(moves)]
    if step and moves.size and np.mean(np.abs(moves - step) < 0.02 * step) > _STEPPED:
        return 0.0
    return step if values.size and step > _COARSE * float(np.ptp(values)) else 0.0


def noise(runs: Sequence[Array]) -> float:
    """Standard deviation of the noise, from second differences; fast motion counts as noise.

    Infinite if there are too few readings.
    """
    bends = np.concatenate([np.abs(np.diff(values, 2)) for values in runs] or [np.zeros(0)])
    bends = bends[np.isfinite(bends)]
    return float(np.median(bends)) / (0.6745 * np.sqrt(6)) if bends.size else np.inf


def _usual_change(runs: Sequence[Array]) -> float:
    """What 99 % of the changes between samples stay below, accidents left out."""
    changes = np.concatenate([np.abs(np.diff(values)) for values in runs] or [np.zeros(0)])
    changes = changes[np.isfinite(changes)]
    if not changes.size:
        return np.inf
    high = float(np.quantile(changes, 0.99))
    # Short runs: one accident makes two of the largest changes.
    usual = 5.0 * float(np.quantile(changes, 0.9))
    return min(high, usual) if usual > 0 else high


def _usual_departure(runs: Sequence[Array]) -> float:
    """By how much samples usually leave the middle of their neighbours, rest left out."""
    parts = [np.abs(np.diff(values, 2)) / 2 for values in runs if len(values) > 2]
    departures = np.concatenate(parts or [np.zeros(0)])
    departures = departures[departures > 0]
    return float(np.median(departures)) / 0.6745 if departures.size else np.inf


def stretches(mask: Mask) -> list[tuple[int, int]]:
    """First and one-past-last index of every stretch of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def grain(runs: Sequence[Array]) -> float:
    """What all values are multiples of, but for a constant; 0 if there is no such number.

    It may be less than the least distance of two values, which may be two steps and three apart.
    """
    values = np.concatenate([np.ravel(v) for v in runs] or [np.zeros(0)])
    values = np.unique(values[np.isfinite(values)])
    gaps = np.diff(values)
    if len(gaps):
        gaps = gaps[gaps > 1e-9 * max(abs(values[0]), abs(values[-1]))]
    if len(gaps) < 7:
        # Of so few values only even steps say that there are none between them.
        even = len(gaps) > 1 and np.ptp(gaps) < 0.02 * gaps.min()
        return float(np.median(gaps)) if even and sum(map(np.size, runs)) >= MANY else 0.0
    # Numbers printed with few digits are nearly, not exactly, multiples of their last digit.
    least = step = float(np.median(gaps[gaps < 1.1 * gaps.min()]))
    while step > _PARTS * least:
        beside = np.abs(gaps / step - np.round(gaps / step))
        if (beside < 0.02).all():
            return step
        step *= float(beside[beside >= 0.02].min())
    return 0.0
