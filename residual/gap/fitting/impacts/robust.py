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
