"""Noise read between the rows of a thinned log, where it was read too high from them.

A vibration of which a log holds thirty readings a period, and the rows that are searched two,
scatters from row to row as noise does. From reading to reading it is smooth, and so are the errors
of a simulator that answers late. A swing that is little above the noise is told by its frequency.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.samples import Samples
from residual.gap.data.spectrum import line
from residual.gap.fitting import noise
from residual.gap.model import paths
from residual.gap.model.model import Model
from residual.trajectories import Trajectory
from sims.host import HostSimulator

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Times what local cubics leave of the readings, beyond which noise is not believed.
SMOOTH = 5.0
#: The same where what the simulator misses from reading to reading has a frequency of its own.
SWINGING = 1.5
#: Part of successive readings that are equal, beyond which a sensor may be slower than its log.
HELD = 0.4
#: Part of rows with a reading, below which it is.
MOSTLY = 0.8
#: Readings of a stretch, and of all stretches where rows advance at once and where they do not.
STRETCH, AT_ONCE, BY_ROW = 8 * noise.READINGS, 6000, 1000


def read_closer(
    simulator: HostSimulator,
    trajectories: Sequence[Trajectory],
    floor: noise.Noise,
    stride: int,
    scale: Array,
) -> noise.Noise:
    """Noise of every measured channel, read again from all readings of some stretches where it is
    far above what they scatter.

    Args:
        simulator: The nominal one.
        trajectories: What was recorded.
        floor: Noise from the rows that are searched.
        stride: Readings in a row of those.
        scale: Typical variation of every state, (n_s,).
    """
    if stride == 1:
        return floor
    most = AT_ONCE if simulator.advances_rows_at_once else BY_ROW
    samples = Samples.join(_stretches(trajectories, most), simulator.substeps)
    scatter = noise.local_noise(samples)
    swinging = (floor.sigma > SWINGING * scatter).any() and _swings(simulator, trajectories)
    above = (SWINGING if swinging else SMOOTH) * scatter
    doubtful = (floor.sigma > above) & _reads_each_row(samples)
    if not doubtful.any():
        return floor
    model, none = Model(simulator), np.zeros(0)
    nodes = paths.measured(model, samples, none)
    closer = noise.estimate(model, samples, nodes, none, scatter, scale)
    lower = doubtful & (closer.sigma < floor.sigma)
    return noise.Noise(
        np.where(lower, closer.sigma, floor.sigma), np.where(lower, closer.error, floor.error)
    )


def _swings(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> bool:
    """Whether what a simulator misses from each reading to the next has a frequency of its own."""
    if not simulator.advances_rows_at_once:
        return False
    samples, model, none = Samples.join(trajectories, 1), Model(simulator), np.zeros(0)
    _, missed = paths.misses(model, samples, none)
    return any(line(samples, missed[:, column]) for column in samples.measured)


def _reads_each_row(samples: Samples) -> Mask:
    """Measured channels with a fresh reading in most rows, (m,): between those of a sensor that is
    slower than its log, left out or repeated, there is nothing to read."""
    seen = samples.seen[:, samples.measured]
    there = np.isfinite(seen).mean(axis=0) > MOSTLY
    return np.asarray(there & ((np.diff(seen, axis=0) == 0).mean(axis=0) < HELD))


def _stretches(trajectories: Sequence[Trajectory], most: int) -> list[Trajectory]:
    """Pieces of the records, evenly over them, with no more than so many readings in all."""
    total = sum(len(run.times) for run in trajectories)
    apart = max(STRETCH, int(np.ceil(STRETCH * total / most)))
    return [
        run.piece(start, start + STRETCH, f"{run.name} {start}")
        for run in trajectories
        for start in range(0, max(len(run.times) - STRETCH, 1), apart)
    ]
