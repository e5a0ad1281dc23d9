"""Sensors at the end of their range."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.logs.faults import in_full_motion, rounding, stretches
from residual.logs.frozen import equal_by_chance

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Samples in a row at the end of a sensor's range.
_CLIPPED = 4
# Part of the usual motion by which they differ at most: noise of what comes after its range.
_STILL = 0.3


def clipped_samples(runs: Sequence[Array]) -> list[Mask]:
    """Stays at the greatest or least value of all, reached and left in full motion twice or more;
    noise moves them by far less than motion does.

    A sensor at the end of its range shows so, and so does a joint at a stop; motion that turns back
    by itself is slow there. Where readings scatter too much for that, twice as many equal ones in a
    row as chance makes tell the same; at zero sensors may hold still.

    Args:
        runs: As for ``wild_samples``.
    """
    found = [np.zeros(len(values), bool) for values in runs]
    known = np.concatenate([values[np.isfinite(values)] for values in runs] or [np.zeros(0)])
    moving = np.abs(np.concatenate([np.diff(values) for values in runs] or [np.zeros(0)]))
    moving = moving[moving > 0]
    if not moving.size:
        return found
    least = max(0.3 * float(np.median(moving)), 1.5 * rounding(runs))
    chance = 2 * equal_by_chance(runs)
    for end in (known.min(), known.max()):
        far = [np.abs(values - end) for values in runs]
        for width in (0.0, _STILL * least):
            stays = [
                [(a, b) for a, b in stretches(there <= width) if b - a >= _CLIPPED] for there in far
            ]
            if _in_full_motion_twice(runs, stays, least) or (
                width == 0.0 != end and _too_still(stays, chance)
            ):
                for mask, spans in zip(found, stays, strict=True):
                    for a, b in spans:
                        mask[a:b] = True
                break
    return found


def _in_full_motion_twice(
    runs: Sequence[Array], stays: Sequence[Sequence[tuple[int, int]]], least: float
) -> bool:
    """Whether two stays at an end or more were reached and left in full motion."""
    # The last step to the end is cut short, and so is the first from it.
    times = sum(
        all(
            in_full_motion(part, least, 2)
            for part in (values[max(a - 4, 0) : a], values[b : b + 4][::-1])
        )
        for values, spans in zip(runs, stays, strict=True)
        for a, b in spans
    )
    return times > 1


def _too_still(stays: Sequence[Sequence[tuple[int, int]]], chance: float) -> bool:
    """Whether two stays at an end or more are longer than ``chance`` makes them."""
    return sum(b - a > chance for spans in stays for a, b in spans) > 1
