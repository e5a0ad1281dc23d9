"""A lag as MuJoCo has it: the filtered input at the end of each step, not its mean."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sims.compiled import compiled
from sims.drive import Integers, contiguous
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
    ``sims.drive.lagged``; rises are zero.
    """
    given = contiguous(means, rises, durations, time_constant, start, bounds)
    ends = np.empty(means.shape)
    return ends, np.zeros(means.shape), _at_ends(*given, ends)


@compiled
def _at_ends(
    means: Array, _: Array, durations: Array, constants: Array, start: Array, bounds: Integers,
    ends: Array,
) -> Array:  # fmt: skip
    """Writes the output, and returns where it ends, (rows,)."""
    rows, length, substeps = means.shape
    y = np.empty(rows)
    for v in range(rows):
        record = 0
        for t in range(length):
            if t == bounds[record]:
                y[v] = start[v, record]
                record += 1
            ratio = durations[t] / substeps / constants[v]
            stays, comes = np.exp(-ratio), -np.expm1(-ratio)
            for s in range(substeps):
                y[v] = stays * y[v] + means[v, t, s] * comes
                ends[v, t, s] = y[v]
    return y
