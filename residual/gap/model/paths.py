"""The path of the states straight from what was measured, where every fit starts."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.samples import Samples, unseen
from residual.gap.model.model import Model
from sims.bonds import Bonds
from sims.simulator import Channel

Array = NDArray[np.float64]

#: Rows that are reckoned one after the other; longer runs are cut, and the cuts gone over again.
LONGEST = 400


def measured(model: Model, samples: Samples, theta: Array) -> Array:
    """Nodes straight from the measurement; an unmeasured rate by central differences.

    What cannot be told so, such as the level of a tank without a sensor, is where the model goes
    from zero, or from where bonds have it, while the measured states are as measured: bonds alone
    would carry their noise over.
    """
    channels = model.simulator.physical_channels
    names = [c.name for c in channels]
    nodes = np.array(samples.seen[:, : len(channels)])
    for start, stop in samples.runs:
        rows = slice(start, stop)
        for i, channel in enumerate(channels):
            column = nodes[rows, i]
            good = np.isfinite(column)
            if not good.any() and channel.kind == "rate" and channel.rate_of in names:
                column[:] = _slope(samples, nodes, rows, names.index(channel.rate_of))
            elif not good.any():
                column[:] = 0.0
            elif not good.all():
                at = samples.times[rows]
                column[~good] = np.interp(at[~good], at[good], column[good])
    if model.has_sensor:
        nodes = model.bind(theta).unsense(nodes)
    if model.simulator.bonds is not None:
        nodes = _filled(nodes, samples, channels, model.simulator.bonds)
    nodes = model.widen(samples, nodes, theta)
    hidden = np.flatnonzero(unseen(channels, samples.measured))
    return _reckoned(model, samples, nodes, theta, hidden) if hidden.size else nodes


def misses(
    model: Model, samples: Samples, theta: Array, rows: NDArray[np.int64] | None = None
) -> tuple[Array, Array]:
    """Where a model is begun as measured, and by how much it misses the row after that.

    Args:
        model: Without impacts.
        samples: What was measured.
        theta: Its numbers.
        rows: Where it is begun, (n,); all but the last by default, of which those at the end of a
            record miss the beginning of another.

    Returns:
        States, and the next ones less what the model makes of them, (n, n_s) each.
    """
    nodes = measured(model, samples, theta)
    begun = np.arange(len(nodes) - 1) if rows is None else rows
    after = model.advance(samples, nodes[begun][None], theta[None], begun)[0]
    return nodes[begun], nodes[begun + 1] - after


def _filled(nodes: Array, samples: Samples, channels: Sequence[Channel], bonds: Bonds) -> Array:
    """Nodes with what bonds tell of positions that were not measured, and their rates."""
    names = [channel.name for channel in channels]
    told = bonds.told(nodes, unseen(channels, samples.measured))
    nodes = bonds.filled(nodes, told)
    for i, channel in enumerate(channels):
        if told[i] and channel.kind == "rate":
            position = names.index(str(channel.rate_of))
            for rows in itertools.starmap(slice, samples.runs):
                nodes[rows, i] = _slope(samples, nodes, rows, position)
    return nodes


def _slope(samples: Samples, nodes: Array, rows: slice, position: int) -> Array:
    """Rate of a position over a run by central differences, (n,)."""
    slope: Array = np.gradient(nodes[rows, position], samples.times[rows])
    return slope


def _reckoned(
    model: Model, samples: Samples, nodes: Array, theta: Array, hidden: NDArray[np.int64]
) -> Array:
    """Nodes with the hidden columns as the model moves them, row after row."""
    nodes = nodes.copy()
    cuts = [(a, min(a + LONGEST, stop)) for start, stop in samples.runs
            for a in range(start, stop, LONGEST)]  # fmt: skip
    first, end = np.array(cuts).T
    heads = np.isin(np.arange(len(nodes)), [start for start, _ in samples.runs])
    for _ in range(2 if len(cuts) > len(samples.runs) else 1):
        for k in range(int((end - first).max())):
            rows = (first + k)[first + k < end]
            rows = rows[rows + 1 < len(nodes)]
            after = model.advance(samples, nodes[rows][None], theta[None], rows)[0][:, hidden]
            good = np.isfinite(after).all(axis=1) & ~heads[rows + 1]
            nodes[np.ix_(rows[good] + 1, hidden)] = after[good]
    return nodes


def variation(samples: Samples, nodes: Array, length: int = 25) -> Array:
    """Root mean square variation of each state within ``length`` samples, to scale states.

    Not the usual one, which is next to nothing of a system that rests for most of a record.
    """
    spreads = []
    for start, stop in samples.runs:
        for a in range(start, max(stop - length, start + 1), length):
            spreads.append(nodes[a : min(a + length, stop)].std(axis=0))
    spread = np.sqrt(np.square(spreads).mean(axis=0))
    typical = nodes.std(axis=0)
    return np.maximum(spread, np.maximum(1e-3 * typical, 1e-9))
