"""Whether a constant stays the same over the log: zeros of sensors creep, and loads come and go.

Folds interpolate, so that a number which creeps is about the same in each of them. Here every
number may differ between records, change along them, and with how far the system moves: a damper
that is harder one way pushes in the mean, and at rest not at all.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from residual.gap.fitting.contract import Fit
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.search.pool import Key
from residual.gap.search.sets import Search
from sims.effects.curve import Curve

Array = NDArray[np.float64]

#: Part of a constant by which it may differ in one record, or change along them, up and down.
SAME = 0.33
#: Chance that any such change of a true constant is taken for one.
CHANCE = 0.01
#: Blocks below which nothing is said, and the same of a record.
FEW, FEW_OF_ONE = 6, 2
#: Times that a size may be larger at one end of the records than at the other.
APART = 3.0


def creeps(search: Search, key: Key, number: int) -> bool:
    """Whether a constant push is clearly another one in one of the records, or changes on the way,
    or with how far the system moves.

    Args:
        search: With the fitted set.
        key: The set.
        number: Its member; of other than constants nothing is asked.
    """
    fit = search.tried[key]
    if not search.candidates[number].effect.creeps or len(search.fitter.blocks) < FEW:
        return False
    courses = list(_courses(search))
    return any(
        change_over(fit, search.fitter.blocks.block, j, course, CHANCE / len(courses))
        for j in _strengths(fit, key.index(number))
        for course in courses
    )


def on_the_way(search: Search, key: Key, number: int) -> dict[int, tuple[float, float]]:
    """Sizes at the beginning of the records and at their end, of the numbers of a set that clearly
    change on the way, by place: friction falls as it warms.

    What strikes the ground is not asked, nor are curves, of which each record shows other points.

    Args:
        search: With the fitted set.
        key: The set.
        number: Its member.
    """
    fit, fitter = search.tried[key], search.fitter
    effect = search.candidates[number].effect
    if not isinstance(fitter, SmoothFitter) or isinstance(effect, Curve):
        return {}
    if len(fitter.blocks) < FEW:
        return {}
    course, found, least = along_windows(search), {}, whole_size(search, key, number)
    for j in _strengths(fit, key.index(number)):
        if change := change_over(fit, fitter.blocks.block, j, course, CHANCE, least):
            knob, size = fit.model.knobs[j], float(fit.theta[j])
            begin, end = np.clip([size - change / 2, size + change / 2], knob.low, knob.high)
            found[j] = (float(begin), float(end))
    return found


def far_apart(ends: tuple[float, float]) -> bool:
    """Whether a size changes so much on the way that it is hardly that of one effect: oil that
    warms halves a friction, but no lag is five times as long where steps are large."""
    smaller, larger = sorted(ends, key=abs)
    return smaller * larger < 0 or abs(larger) > APART * abs(smaller)


def whole_size(search: Search, key: Key, number: int) -> float:
    """The size that the strengths of a member are parts of; 0 if each stands for itself."""
    if not search.candidates[number].effect.compound:
        return 0.0
    fit = search.tried[key]
    return float(np.abs(fit.theta[_strengths(fit, key.index(number))]).max())


def _strengths(fit: Fit, place: int) -> list[int]:
    """Places of the strengths of a member."""
    own = np.flatnonzero(fit.model.owner == place)
    return [int(j) for j in own if fit.model.knobs[j].strength]


def along_records(search: Search) -> Array:
    """Where every sample lies in its record, from -1/2 to 1/2, (n,)."""
    samples = search.fitter.samples
    along = np.zeros(len(samples))
    for start, stop in samples.runs:
        times = samples.times[start:stop]
        along[start:stop] = (times - times[0]) / max(float(np.ptp(times)), 1e-300) - 0.5
    return along


def along_windows(search: Search) -> Array:
    """Where every window begins in its record, from -1/2 to 1/2, (W,)."""
    return along_records(search)[search.fitter.blocks.windows.index[:, 0]]


def by_motion(search: Search) -> Array:
    """The rank of every window by how far what was measured moves in it, from -1/2 to 1/2, (W,)."""
    samples, windows = search.fitter.samples, search.fitter.blocks.windows
    seen = samples.seen[:, samples.measured]
    inside = windows.inside[..., None] & np.isfinite(seen[windows.index])
    there = np.where(inside, seen[windows.index], 0.0)
    count = np.maximum(inside.sum(axis=1), 1)
    around = np.where(inside, there - (there.sum(axis=1) / count)[:, None], 0.0)
    variances = (around**2).sum(axis=1) / count
    moved = (variances / np.maximum(variances.mean(axis=0), 1e-300)).sum(axis=1)
    return np.argsort(np.argsort(moved)) / max(len(moved) - 1, 1) - 0.5


def _courses(search: Search) -> Iterator[Array]:
    """How a number may go over the windows, each (W,): along every record from -1/2 to 1/2, from
    where least moves to where most does, and otherwise in one of the records."""
    blocks = search.fitter.blocks
    windows = blocks.windows
    yield along_windows(search)
    yield by_motion(search)
    records = np.unique(windows.run)
    for run in records if len(records) > 1 else ():
        own = windows.run == run
        if len(np.unique(blocks.block[own])) >= FEW_OF_ONE:
            yield own.astype(float)


def change_over(
    fit: Fit, block: NDArray[np.int64], j: int, course: Array, chance: float, least: float = 0.0
) -> float:
    """How much a number changes over a course over the windows; 0 if it does not clearly do so, or
    by less than a part of itself, or of ``least``, the size that it is a part of.
    """
    column = (fit.by_knob[..., j] * course[:, None])[..., None]
    change = clear_number(fit, block, column, chance)
    return change if abs(change) > SAME * max(abs(float(fit.theta[j])), least) else 0.0


def clear_number(fit: Fit, block: NDArray[np.int64], more: Array, chance: float) -> float:
    """The number of the last of further columns (W, R, c); 0 if it may be zero.

    By one Gauss-Newton step with them as further unknowns, and the sandwich over blocks
    (White, "Maximum likelihood estimation of misspecified models", Econometrica 50, 1982).
    """
    root = np.sqrt(fit.weights)[:, None]
    rows = np.concatenate([fit.by_knob, more], axis=2)
    rows, residual = rows * root[..., None], fit.projected * root
    scale = np.sqrt(np.maximum((rows**2).sum(axis=(0, 1)), 1e-300))
    rows = rows / scale
    inverse = np.linalg.pinv(np.einsum("wri,wrj->ij", rows, rows), rcond=1e-9)
    step = inverse @ np.einsum("wri,wr->i", rows, residual)
    left = residual - rows @ step
    per_window = np.einsum("wri,wr->wi", rows, left)
    count = int(block.max()) + 1
    scores = np.stack([per_window[block == b].sum(axis=0) for b in range(count)])
    freedom = max(count - len(step), 1)
    meat = scores.T @ scores * count / freedom
    sandwich = float((inverse @ meat @ inverse)[-1, -1])
    plain = float((left**2).sum() / max((left != 0).sum() - len(step), 1) * inverse[-1, -1])
    number, error = float(step[-1]), np.sqrt(max(sandwich, plain, 0.0))
    clear = abs(number) > error * stdtrit(freedom, 1 - chance / 2)
    return number / float(scale[-1]) if clear else 0.0
