"""Frequencies at which a series stands out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import percentile_filter

from residual.gap.data.samples import Samples

Array = NDArray[np.float64]

#: Power over the median around it from which on a frequency stands out; by chance one bin in 3e7
#: does.
STANDS_OUT = 25.0
#: Bins, as a share of all, over which that median is taken.
AROUND = 0.05
#: Periods in the longest record, samples in a period, and samples of a record, at the least.
PERIODS, PER_PERIOD, ROWS = 5, 3, 64


def line(samples: Samples, series: Array) -> float | None:
    """The frequency in Hz at which a series, (n,), stands out, if it does at one."""
    power, step = _spectrum(samples, series)
    if power is None:
        return None
    longest = max(stop - start for start, stop in samples.runs)
    frequencies = np.fft.rfftfreq(2 * (len(power) - 1), step)
    there = (frequencies * longest * step >= PERIODS) & (frequencies * PER_PERIOD * step <= 1)
    clear = np.where(there, _over_median(power), 0.0)
    place = int(np.argmax(clear))
    return float(frequencies[place]) if clear[place] > STANDS_OUT else None


def swings(samples: Samples, series: Array, frequencies: Sequence[float]) -> bool:
    """Whether a series, (n,), stands out at one of some frequencies, in Hz."""
    power, step = _spectrum(samples, series)
    if power is None:
        return False
    clear, width = _over_median(power), 2 * (len(power) - 1) * step
    places = [round(frequency * width) for frequency in frequencies]
    return any(clear[max(at - 4, 0) : at + 5].max(initial=0.0) > STANDS_OUT for at in places)


def _spectrum(samples: Samples, series: Array) -> tuple[Array | None, float]:
    """Power of all records together, over frequencies that are as close as the longest allows, and
    the sampling time; None where records are short."""
    runs = [(start, stop) for start, stop in samples.runs if stop - start >= ROWS]
    step = float(np.median(samples.durations))
    if not runs or step <= 0:
        return None, step
    size = 2 ** int(np.ceil(np.log2(4 * max(stop - start for start, stop in runs))))
    power = np.zeros(size // 2 + 1)
    for start, stop in runs:
        part = np.nan_to_num(series[start : stop - 1])
        part = (part - part.mean()) * np.hanning(len(part))
        power += np.abs(np.fft.rfft(part, size)) ** 2
    return power, step


def _over_median(power: Array) -> Array:
    around = percentile_filter(power, 50, size=max(9, int(AROUND * len(power)) | 1), mode="nearest")
    return power / np.maximum(around, 1e-300)
