"""Forecasts of parts of windows, for many vectors of numbers at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.samples import Samples
from residual.gap.fitting.smooth import LOST, SmoothFitter
from residual.gap.model.model import Model
from sims.simulator import Channel

Array = NDArray[np.float64]

#: Windows that are foretold, at most: what is found is only where a fit begins.
WINDOWS = 16
#: Least intervals of a part.
LEAST = 5


class ShortForecasts:
    """Forecasts from the measured path's own states, and from other rates, the best of which count.

    What sticks starts and stops within a sample, so that a difference over the samples around it
    is a wrong rate: those to the sample before and after are tried, too, and rest.

    Args:
        fitter: Holds the windows.
        model: Simulator with effects.
        parts: That every window is foretold in, fewer where it is short.
    """

    def __init__(self, fitter: SmoothFitter, model: Model, parts: int) -> None:
        windows, samples = fitter.blocks.windows, fitter.samples
        places = np.linspace(0, len(windows) - 1, min(len(windows), WINDOWS))
        chosen = np.unique(places.round().astype(int))
        last = windows.index.shape[1] - 1
        self.fitter, self.model = fitter, model
        self.steps = min(max(-(-last // parts), LEAST), last)
        # Parts share the sample between them; the last one may be shorter.
        columns = np.arange(0, last, self.steps)[:, None] + np.arange(self.steps + 1)
        index = windows.index[chosen][:, np.minimum(columns, last)].reshape(-1, self.steps + 1)
        valid = fitter.valid[chosen][:, np.minimum(columns, last)] & (columns <= last)[..., None]
        self.rows = index[:, 0]
        self.seen = samples.seen[index][..., samples.measured]
        self.valid = valid.reshape(self.seen.shape)
        self.limit = LOST * np.nanstd(samples.seen[:, samples.measured], axis=0)
        channels = model.simulator.physical_channels
        self.rates = [i for i, channel in enumerate(channels) if channel.kind == "rate"]
        nodes = fitter.nodes[:, : len(channels)]
        self.begun = start_rates(channels, samples, nodes)[:, self.rows][..., self.rates]

    def misses(self, thetas: Array) -> Array:
        """Logarithm of the squared error of forecasts by each vector of numbers, (V, p) -> (V,)."""
        model, samples, nodes = self.model, self.fitter.samples, self.fitter.nodes
        each, rows = len(thetas), len(self.rows)
        if model.width == model.physical:
            states = np.repeat(nodes[self.rows][None], each, axis=0)
        else:
            states = np.stack([model.widen(samples, nodes, t)[self.rows] for t in thetas])
        begun = np.repeat(states[None], len(self.begun), axis=0)
        begun[..., self.rates] = self.begun[:, None]
        path = self.fitter.shown(
            model, np.tile(self.rows, len(begun) * each), begun.reshape(-1, states.shape[-1]),
            self.steps, thetas, np.tile(np.repeat(np.arange(each), rows), len(begun)),
        ).reshape(len(begun), each, *self.seen.shape)  # fmt: skip
        gap = np.where(np.isfinite(path), self.seen - path, self.limit)
        gap = np.where(self.valid, np.clip(gap, -self.limit, self.limit) / self.fitter.sigma, 0.0)
        best = (gap**2).sum(axis=(3, 4)).min(axis=0)
        return np.asarray(np.log(best.sum(axis=1) + 1e-300))


def start_rates(channels: tuple[Channel, ...], samples: Samples, nodes: Array) -> Array:
    """States with rates as on the path, to the sample before, after, and zero, (k, n, n_p).

    Args:
        channels: Of the states.
        samples: The table; what is measured keeps the rates that were measured beside zero.
        nodes: The measured path, (n, n_p).
    """
    names = [channel.name for channel in channels]
    before, after, rest = nodes.copy(), nodes.copy(), nodes.copy()
    derived = 0
    for i, channel in enumerate(channels):
        if channel.kind != "rate":
            continue
        rest[:, i] = 0.0
        if i in samples.measured or channel.rate_of not in names:
            continue
        derived += 1
        position = nodes[:, names.index(channel.rate_of)]
        for start, stop in samples.runs:
            change = np.diff(position[start:stop]) / np.diff(samples.times[start:stop])
            before[start + 1 : stop, i] = change
            after[start : stop - 1, i] = change
    return np.stack([nodes, before, after, rest] if derived else [nodes, rest])
