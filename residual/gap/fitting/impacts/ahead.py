"""What follows a window: forecasts from its fitted start state, which tell most of strengths.

Within a window start states make up for much of what a simulator lacks, and each is found by a
search that may end in one of many minima. What follows is not fitted by them: a forecast errs by
what strengths lack, smoothly enough for a method of Gauss and Newton with wide steps.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from residual.gap.fitting.impacts.robust import TAILS

if TYPE_CHECKING:
    from residual.gap.fitting.impacts.single_shooting import WindowData

Array = NDArray[np.float64]

#: Least unit of an error, as a share of the usual one of the nominal simulator.
LEAST = 0.05
#: Largest error in such units, and that of a forecast that was not finite.
LOST = 1e4


@dataclasses.dataclass(frozen=True)
class Ahead:
    """How forecasts past the end of windows are weighed.

    Attributes:
        unit: What the noise of a window makes of each value that follows it, (steps, m). Below it
            an error hardly counts; above, a loss goes with its logarithm, so that lost forecasts
            say little, and better ones much.
    """

    unit: Array

    @property
    def steps(self) -> int:
        """Rows past the end of a window."""
        return len(self.unit)

    def residual(self, data: WindowData, shown: Array) -> Array:
        """Errors of what was foretold (W, L + steps, m), of which the squares of a window add up to
        ``TAILS`` where all err by a unit, (W, steps m)."""
        gap = errors(data, shown) / self.unit
        count = np.maximum(np.isfinite(gap).sum(axis=(1, 2)), 1)
        gap = np.clip(np.nan_to_num(gap), -LOST, LOST).reshape(len(data), -1)
        gap[np.isnan(shown).any(axis=(1, 2))] = LOST
        return gap * np.sqrt(TAILS / count)[:, None]


def units(data: WindowData, shown: Array, by_start: Array, moved: Array) -> Array:
    """Units of errors from what noise makes of start states, in the middle window, (steps, m).

    Args:
        data: The windows.
        shown: What was foretold, (W, L + steps, m).
        by_start: Derivative of the whitened windows by their start states, (W, R, n_p).
        moved: That of what was foretold, (W, L + steps, m, n_p).
    """
    ahead = moved[:, data.windows.index.shape[1] :]
    spread = np.linalg.pinv(by_start.transpose(0, 2, 1) @ by_start, rcond=1e-10, hermitian=True)
    variance = np.einsum("wtmi,wij,wtmj->wtm", ahead, spread, ahead)
    usual = np.sqrt(_middle(errors(data, shown) ** 2))
    noise = np.sqrt(_middle(np.maximum(variance, 0.0)) + data.sigma**2)
    return np.maximum(noise, LEAST * usual)


def _middle(values: Array) -> Array:
    """The median of what is known over all windows, (W, steps, m) -> (steps, m); zero where nothing
    is, as past windows that are whole records."""
    known = np.isfinite(values).any(axis=0)
    found = np.zeros(values.shape[1:])
    found[known] = np.nanmedian(values[:, known], axis=0)
    return found


def errors(data: WindowData, shown: Array) -> Array:
    """What was measured past the windows less what was foretold (W, L + steps, m), (W, steps, m);
    NaN where nothing was."""
    size = data.windows.index.shape[1]
    rows = rows_ahead(data, shown.shape[1] - size)
    gap = data.samples.seen[rows][..., data.samples.measured] - shown
    return np.where(inside(data, rows), gap, np.nan)[:, size:]


def rows_ahead(data: WindowData, steps: int) -> NDArray[np.int64]:
    """Rows of every window and of its forecast, (W, L + steps)."""
    index = data.windows.index
    rows = index[:, :1] + np.arange(index.shape[1] + steps)
    return np.minimum(rows, len(data.samples) - 1)


def inside(data: WindowData, rows: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which of them belong to the window's run, (W, L + steps, 1)."""
    ends = np.array([data.samples.runs[r][1] for r in data.windows.run])
    index = data.windows.index[:, :1] + np.arange(rows.shape[1])
    return (index < ends[:, None])[..., None]
