"""A lag as MuJoCo has it: the filtered input at the end of each step, not its mean."""

from __future__ import annotations

import numpy as np

from sims.drive import column
from sims.simulator import Array


def lagged_at_ends(
    means: Array,
    rises: Array,
    durations: Array,
    time_constant: float | Array,
    start: Array,
) -> tuple[Array, Array, Array]:
    """First-order filter of an input that is held in each sub-step, sampled at its end.

    It is what an actuator with ``dyntype="filterexact" actearly="true"`` receives, so that a
    corrected model file moves as the corrected simulator. Arguments and values are those of
    ``sims.drive.lagged``; rises are zero.
    """
    substeps = means.shape[2]
    constants = np.broadcast_to(np.asarray(time_constant, float), len(means))
    with np.errstate(divide="ignore"):
        ratio = (durations / substeps) / constants[:, None]
    stays = np.exp(-ratio)
    gained = means * -np.expm1(-ratio)[..., None]
    # Only from interval to interval is it a recursion in Python; inside, all rows at once.
    added = np.zeros_like(ratio)
    for i in range(substeps):
        added = added * stays + gained[:, :, i]
    kept = stays**substeps
    begins = np.empty_like(ratio)
    y = np.array(np.broadcast_to(start, len(means)), float)
    for k in range(ratio.shape[1]):
        begins[:, k] = y
        y = kept[:, k] * y + added[:, k]
    ends = np.empty_like(means)
    now = begins
    for i in range(substeps):
        now = stays * now + gained[:, :, i]
        ends[:, :, i] = now
    there = np.asarray(column(constants))[..., None] > 0
    return np.where(there, ends, means), np.zeros_like(means), y
