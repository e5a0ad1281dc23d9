"""How sure the fitted numbers are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from residual.gap.shooting import Fit
from residual.gap.signatures import flatten
from residual.gap.windows import Windows

Array = NDArray[np.float64]


def covariance(fit: Fit, windows: Windows, size: int) -> Array:
    """Covariance of the unknowns, the larger of two for each unknown.

    One is Gauss-Newton's with start states projected out, times the residual variance; the
    other the sandwich over runs, which allows for errors that go together within a run.
    Source: White, "Maximum likelihood estimation of misspecified models", Econometrica 50 (1982).

    Args:
        fit: A fit with at least one unknown.
        windows: Its windows.
        size: Number of residuals.
    """
    p = len(fit.theta)
    rows = flatten(fit.by_knob, fit.weights)
    residual = flatten(fit.projected, fit.weights)
    scale = np.sqrt(np.maximum((rows**2).sum(axis=0), 1e-300))
    unit = rows / scale
    inverse = np.linalg.pinv(unit.T @ unit, rcond=1e-12)
    freedom = max(size - fit.basis.shape[2] * len(windows) - p, 1)
    variance = max(1.0, float(residual @ residual) / freedom)
    plain = variance * inverse
    runs = np.unique(windows.run)
    per_window = (unit * residual[:, None]).reshape(len(windows), -1, p).sum(axis=1)
    scores = np.stack([per_window[windows.run == run].sum(axis=0) for run in runs])
    found = plain
    if len(runs) >= 4:
        factor = len(runs) / (len(runs) - 1)
        sandwich = inverse @ (factor * scores.T @ scores) @ inverse
        ratio = np.sqrt(np.maximum(np.diag(sandwich) / np.maximum(np.diag(plain), 1e-300), 1.0))
        found = plain * np.outer(ratio, ratio)
    return found / np.outer(scale, scale)
