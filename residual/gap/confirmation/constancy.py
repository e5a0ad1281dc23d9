"""Whether a constant stays the same over the log: zeros of sensors creep, and loads come and go.

Folds interpolate, so that a number which creeps is about the same in each of them. Here every
number may differ between records, and change along them.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t

from residual.gap.fitting.contract import Fit
from residual.gap.search.sets import Key, Search

Array = NDArray[np.float64]

#: Part of a constant by which it may differ in one record, or change along them, up and down.
SAME = 0.33
#: Chance that any such change of a true constant is taken for one.
CHANCE = 0.01
#: Blocks below which nothing is said, and the same of a record.
FEW, FEW_OF_ONE = 6, 2


def creeps(search: Search, key: Key, number: int) -> bool:
    """Whether a constant push is clearly another one in one of the records, or changes on the way.

    Args:
        search: With the fitted set.
        key: The set.
        number: Its member; of other than constants nothing is asked.
    """
    fit = search.tried[key]
    if not search.candidates[number].effect.creeps or len(search.fitter.blocks) < FEW:
        return False
    own = [int(j) for j in np.flatnonzero(fit.model.owner == key.index(number))]
    courses = list(_courses(search))
    return any(
        _changes(fit, search.fitter.blocks.block, j, course, CHANCE / len(courses))
        for j in own
        if fit.model.knobs[j].strength
        for course in courses
    )


def along_records(search: Search) -> Array:
    """Where every sample lies in its record, from -1/2 to 1/2, (n,)."""
    samples = search.fitter.samples
    along = np.zeros(len(samples))
    for start, stop in samples.runs:
        times = samples.times[start:stop]
        along[start:stop] = (times - times[0]) / max(float(np.ptp(times)), 1e-300) - 0.5
    return along


def _courses(search: Search) -> Iterator[Array]:
    """How a number may go over the windows, each (W,): along every record from -1/2 to 1/2, and
    otherwise in one of the records."""
    blocks = search.fitter.blocks
    windows = blocks.windows
    yield along_records(search)[windows.index[:, 0]]
    records = np.unique(windows.run)
    for run in records if len(records) > 1 else ():
        own = windows.run == run
        if len(np.unique(blocks.block[own])) >= FEW_OF_ONE:
            yield own.astype(float)


def _changes(fit: Fit, block: NDArray[np.int64], j: int, course: Array, chance: float) -> bool:
    """Whether a number clearly follows a course over the windows, by more than a part of itself.

    By one Gauss-Newton step with the course as one more unknown, and the sandwich over blocks
    (White, "Maximum likelihood estimation of misspecified models", Econometrica 50, 1982).
    """
    root = np.sqrt(fit.weights)[:, None]
    rows = np.concatenate([fit.by_knob, (fit.by_knob[..., j] * course[:, None])[..., None]], axis=2)
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
    change, error = abs(float(step[-1])), np.sqrt(max(sandwich, plain, 0.0))
    clear = change > error * t.ppf(1 - chance / 2, freedom)
    return bool(clear and change / scale[-1] > SAME * abs(float(fit.theta[j])))
