"""A lag as MuJoCo has it: the filtered input at the end of each step, not its mean."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sims.followers import lagged
from sims.simulator import Array


def lagged_at_ends(
    means: Array,
    rises: Array,
    durations: Array,
    time_constant: float | Array,
    start: Array,
    bounds: Sequence[int],
) -> tuple[Array, Array, Array]:
    """First-order filter of an input that is held in each sub-step, sampled at its end.

    It is what an actuator with ``dyntype="filterexact" actearly="true"`` receives, so that a
    corrected model file moves as the corrected simulator. Arguments and values are those of
    ``sims.followers.lagged``; rises are zero.
    """
    through, tilts, last = lagged(
        means, np.zeros(means.shape), durations, time_constant, start, bounds
    )
    constants = np.broadcast_to(np.asarray(time_constant, float), len(means))
    with np.errstate(divide="ignore"):
        ratio = durations / means.shape[2] / constants[:, None]
    # Of what the output lacks at first so much is left at the end, over what is in the mean.
    large = np.minimum(ratio, 700.0)
    left = np.where(ratio < 700.0, large / np.expm1(large), 0.0)
    return means + (through - means) * left[..., None], np.zeros_like(tilts), last
