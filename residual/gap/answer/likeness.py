"""Whether one law can do what another does: in a log, or in any motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.fitting.contract import Fit
from residual.gap.fitting.screening import beside_starts
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.model.candidates import candidates
from sims.effects.aliases import change
from sims.effects.base import Effect
from sims.effects.curve import Curve
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: Part of what one does that lies beyond a law, below which it is that law.
BEYOND = 0.1
#: States at which motions are compared, and change of a number of a law, in scales.
ROWS, SMALL = 200, 1e-3


def moved(fitter: SmoothFitter, fit: Fit, curve: Curve) -> Array:
    """What a curve does at each of its points in a log, one column each."""
    pool = candidates(fit.model.simulator, [curve], fitter.samples)
    columns = beside_starts(fit, fitter.columns(fit, pool))
    return columns.reshape(-1, columns.shape[-1])


def is_one_of(moved: Array, laws: Sequence[Array]) -> bool:
    """Whether all that columns do lies within what one of the laws can do."""
    size = np.linalg.norm(moved)
    for law in laws:
        left = moved - law @ np.linalg.lstsq(law, moved, rcond=1e-10)[0] if law.size else moved
        if np.linalg.norm(left) <= BEYOND * size:
            return True
    return False


def in_any_motion(
    fitter: SmoothFitter, simulator: HostSimulator, law: Effect, other: Effect
) -> bool:
    """Whether a law can do what another does wherever each state and each input may be: each at
    values of the log, drawn for itself. Strengths of both are zero."""
    rng, samples = np.random.default_rng(0), fitter.samples
    rows = rng.integers(0, len(samples), ROWS)
    states = rng.permuted(fitter.nodes[rows, : len(simulator.physical_channels)], axis=0)
    inputs = rng.permuted(samples.actions[rows], axis=0)
    plain = simulator.with_effects(())

    def does(one: Effect) -> Array:
        changes = [change(plain, one, n, states, inputs, SMALL) for n in one.strengths()]
        return np.stack([column.ravel() for column in changes], axis=1)

    return is_one_of(does(other), [does(law)])
