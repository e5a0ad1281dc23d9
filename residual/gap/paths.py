"""The path of the states straight from what was measured, where every fit starts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from residual.gap.model import Model
from residual.gap.samples import Samples

Array = NDArray[np.float64]


def measured(model: Model, samples: Samples, theta: Array) -> Array:
    """Nodes straight from the measurement; an unmeasured rate by central differences."""
    channels = model.simulator.physical_channels
    names = [c.name for c in channels]
    nodes = np.array(samples.seen[:, : len(channels)])
    for start, stop in samples.runs:
        rows = slice(start, stop)
        for i, channel in enumerate(channels):
            column = nodes[rows, i]
            good = np.isfinite(column)
            if not good.any() and channel.kind == "rate" and channel.rate_of in names:
                position = nodes[rows, names.index(channel.rate_of)]
                column[:] = np.gradient(position, samples.times[rows])
            elif not good.any():
                column[:] = 0.0
            elif not good.all():
                at = samples.times[rows]
                column[~good] = np.interp(at[~good], at[good], column[good])
    if model.has_sensor:
        nodes = model.bind(theta).unsense(nodes)
    return model.widen(samples, nodes, theta)


def variation(samples: Samples, nodes: Array, length: int = 25) -> Array:
    """Typical variation of each state within ``length`` samples, to scale states."""
    spreads = []
    for start, stop in samples.runs:
        for a in range(start, max(stop - length, start + 1), length):
            spreads.append(nodes[a : min(a + length, stop)].std(axis=0))
    spread = np.median(spreads, axis=0)
    typical = nodes.std(axis=0)
    return np.maximum(spread, np.maximum(1e-3 * typical, 1e-9))
