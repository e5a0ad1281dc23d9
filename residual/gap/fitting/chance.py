"""What noise alone can do: how far a cost falls by chance, and a true rival falls short."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtri

from residual.gap.fitting.screening import Signatures

#: Score difference beyond which a rival is excluded. If the rival is true and the two predictions
#: are d standard errors apart, the difference is normal with mean -d^2 and deviation 2 d, and it
#: exceeds z^2 with the largest probability at d = z: that of a normal beyond z, here 1e-3.
TIE = float(ndtri(1e-3)) ** 2
#: Smallest part of the noise energy worth a name; it binds in long logs, where chance alone would
#: let effects in that change the residual by a thousandth.
SHARE = 0.004


def threshold(around: Signatures, size: int) -> float:
    """Fall of the cost that earns an effect a name.

    The largest gain over all candidates is recorded for 400 redraws of the noise, pushed through
    the signatures; the threshold is the 99.9 % point of a Gumbel law fitted to these maxima.

    Args:
        around: Signatures of all candidates around the nominal simulator.
        size: Number of residuals.
    """
    rng = np.random.default_rng(0)
    lengths = np.sqrt(np.maximum(around.strengths, 1e-300))
    alive = around.strengths > 1e-9 * max(around.strengths.max(initial=0.0), 1e-300)
    if not alive.any():
        return max(16.0, SHARE * size)
    unit = around.matrix[:, alive] / lengths[alive]
    # The Gram matrix of unit signatures is the covariance of their products with the noise.
    values, vectors = np.linalg.eigh(unit.T @ unit)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    largest = ((root @ rng.standard_normal((len(values), 400))) ** 2).max(axis=0)
    spread = largest.std() * np.sqrt(6) / np.pi
    point = largest.mean() - 0.5772 * spread - spread * np.log(-np.log(0.999))
    return max(float(point), SHARE * size)
