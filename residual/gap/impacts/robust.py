"""One robust vote for each window: multivariate Student-t instead of least squares.

Two good simulators disagree at impacts, so a share of the windows cannot be explained by any
effect. With Student's t a window's weight falls as a whole once it fits badly; no detector of
impacts is needed, and none of the windows is dropped.
Source: Lange, Little and Taylor, "Robust statistical modeling using the t distribution",
Journal of the American Statistical Association 84 (1989).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Degrees of freedom of Student's t: heavy tails, the usual choice for robust fits.
TAILS = 4.0


def losses(costs: Array, freedom: Array) -> Array:
    """Loss of every window from its squared residual; shapes broadcast."""
    return (TAILS + freedom) * np.log1p(np.maximum(costs, 0.0) / TAILS)


def weights(costs: Array, freedom: Array) -> Array:
    """What a unit of squared residual counts in every window."""
    return (TAILS + freedom) / (TAILS + np.maximum(costs, 0.0))


def trimmed_drop(before: Array, after: Array, trim: float = 0.1) -> float:
    """Share by which the loss falls, the windows that gain and lose most left out.

    A few windows that happen to find a better start state, or an impact that moves into another
    step, then make no effect.

    Args:
        before, after: Loss of every window, (W,).
        trim: Share left out at each end.
    """
    change = np.sort(before - after)
    cut = int(trim * len(change))
    kept = change[cut : len(change) - cut]
    return float(kept.mean() / before.mean()) if before.mean() > 0 else 0.0
