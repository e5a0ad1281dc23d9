"""What a constant push on a joint does to every window."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from residual.gap.fitting.contract import Fit
from residual.gap.fitting.screening import beside_starts
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.model.candidates import candidates
from sims.effects.joint import ConstantLoad

Array = NDArray[np.float64]


def pushed(fitter: SmoothFitter, fit: Fit, joint: str, share: Array | None = None) -> Array:
    """The change of the whitened output, start states projected out, (W, R, 1).

    Args:
        fitter: Of the windows.
        fit: The set beside which it pushes.
        joint: Where.
        share: How much of it acts from each row, (n,); all by default.
    """
    load = candidates(fit.model.simulator, [ConstantLoad(joint)], fitter.samples)
    return beside_starts(fit, fitter.columns(fit, load, share))
