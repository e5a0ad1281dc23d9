"""Times that were rounded when they were printed, put back to the even clock behind them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Samples that an even clock has to agree with before it is believed.
ENOUGH = 20
#: Rounding below this part of a period is of no consequence.
COARSE = 0.05
#: Rounding takes less than itself off a step or adds it; a row that was lost adds a period.
LOST = 1.05
#: Spread of times about the even clock, in roundings, up to which it is their clock.
SPREAD = 1.1
#: Steps of two periods by which rounding is told, as few rows that were lost may lie evenly, and
#: how near to whole numbers of periods these are.
MANY, WHOLE = 8, 0.05
#: Decimals of a second that are looked at.
DECIMALS = 6


def even_clock(times: Array) -> tuple[Array, float]:
    """Evenly spaced times that agree with rounded ones, and to what these were rounded, in s.

    Rows that come every 8.3 ms with times printed to 0.01 s seem to repeat some times and to leave
    others out. Where one even clock is within the rounding of every time, it is the better one,
    unless a step differs from its period by more than rounding makes it: then a row is missing.
    Where a few steps are twice as long as the others, rows were lost there, wherever they lie.

    Args:
        times: In s, not decreasing, (n,).

    Returns:
        The even clock, (n,), and the rounding; the times as they are and 0 if no such clock is.
    """
    n = len(times)
    if n < ENOUGH:
        return times, 0.0
    place = np.arange(n)
    period, start = np.polyfit(place, times, 1)
    rounding = _rounding(times)
    steps = np.diff(times)
    uneven = steps.max() - steps.min() > 0.5 * rounding
    if not uneven or rounding < COARSE * period:
        return times, 0.0
    even = start + period * place
    far = np.ptp(times - even) > SPREAD * rounding
    lost = np.abs(steps - period).max() > LOST * rounding
    few = steps.min() > 0 and _few_rows_lost(steps / np.median(steps))
    if far or lost or few:
        return times, 0.0
    return even, rounding


def _few_rows_lost(steps: Array) -> bool:
    """Whether few steps, in usual ones, differ from those, and are whole numbers of them."""
    others = steps[np.abs(steps - 1) > WHOLE]
    whole = (np.abs(others - np.round(others)) < WHOLE) & (others > 1)
    return bool(whole.all() and len(others) < MANY)


def _rounding(times: Array) -> float:
    """The largest power of ten of which all times are multiples, at least a microsecond, or 0; of
    times that repeat, the least step between others if all are multiples of that."""
    steps = np.diff(times)
    least = float(steps.min(initial=np.inf, where=steps > 0))
    if steps.min() == 0 and np.abs(steps / least - np.round(steps / least)).max() < 1e-3:
        return least
    for decimals in range(DECIMALS + 1):
        scaled = times * 10.0**decimals
        if np.abs(scaled - np.round(scaled)).max() < 1e-3:
            return float(10.0**-decimals)
    return 0.0
