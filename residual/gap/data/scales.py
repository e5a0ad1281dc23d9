"""Typical sizes of states, of channels that declare none: what the log says of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.trajectories import Trajectory
from sims.host import HostSimulator
from sims.simulator import UNDECLARED, Channel

Array = NDArray[np.float64]

#: Times an undeclared scale from which on, or part of it up to which, a channel is of another size.
FAR, NEAR = 10.0, 0.1
#: Rows over which a rate that was not measured is told by its position.
SPAN = 5


def in_measured_scales(simulator: HostSimulator, runs: Sequence[Trajectory]) -> HostSimulator:
    """The simulator with the sizes that a log shows, where its channels declare none.

    A position in mm or a speed in deg/s is far from 1, and trial steps and start values of an
    effect that are made for 1 are then far from what a log can tell of.

    Args:
        simulator: With states in the columns of the runs.
        runs: Measured states by row, NaN where unknown.
    """
    channels = simulator.physical_channels
    names = [channel.name for channel in channels]
    found = {}
    for column, channel in enumerate(channels):
        if channel.scale != UNDECLARED or channel.angle or channel.invariant:
            continue
        size = _size([run.states[:, column] for run in runs], channel)
        if size == 0.0 and channel.rate_of in names:
            place = names.index(channel.rate_of)
            size = _size([_rates(run, place) for run in runs], channel)
        if 0.0 < size < NEAR * UNDECLARED or size > FAR * UNDECLARED:
            found[channel.name] = float(f"{size:.2g}")
    return simulator.with_scales(found) if found else simulator


def _size(values: Sequence[Array], channel: Channel) -> float:
    """How far a channel goes from its zero, or how much it varies if it has none of its own; but
    for a hundredth of the rows, which may be wild. 0 if it was not measured."""
    known = np.concatenate(list(values)) if values else np.empty(0)
    known = known[np.isfinite(known)]
    if not known.size:
        return 0.0
    low, high = np.quantile(known, [0.005, 0.995])
    return float(max(abs(low), abs(high)) if channel.kind == "rate" else (high - low) / 2)


def _rates(run: Trajectory, place: int) -> Array:
    span = min(SPAN, len(run.times) - 1)
    if span < 1:
        return np.empty(0)
    values = run.states[:, place]
    return np.asarray((values[span:] - values[:-span]) / (run.times[span:] - run.times[:-span]))
