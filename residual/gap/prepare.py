"""From trajectories to a fitter: table, windows, blocks, weights of the channels."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap import noise, paths
from residual.gap.blocks import blocks, drive
from residual.gap.fitting import Fit
from residual.gap.model import Model
from residual.gap.numerics import stride_for, substeps_for
from residual.gap.samples import Samples
from residual.gap.smooth import LEAD, SmoothFitter
from residual.gap.windows import cut
from residual.trajectories import Trajectory
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: A window's loss counts by its logarithm beyond so many times the upper quartile of all.
ROBUST = 4.0


def smooth_fitter(
    simulator: HostSimulator, trajectories: Sequence[Trajectory], horizon: float, most: int,
) -> tuple[SmoothFitter, noise.Floor]:  # fmt: skip
    """A fitter for a system without impacts, weighted by what the nominal simulator leaves.

    Args:
        simulator: The nominal simulator.
        trajectories: Measured runs.
        horizon: Forecast length in s.
        most: Largest number of windows.
    """
    stride = stride_for(trajectories, horizon)
    samples = Samples.join(trajectories, substeps_for(simulator, trajectories, stride), stride)
    if not len(samples.measured):
        raise ValueError("no state channel was measured: every value in the trajectories is NaN")
    model = Model(simulator)
    nodes = paths.measured(model, samples, np.zeros(0))
    scale = paths.variation(samples, nodes)
    floor = noise.estimate(model, samples, nodes, np.zeros(0), noise.local_noise(samples), scale)
    length = max(6, round(horizon / 0.75 / samples.step) + 1)
    windows = cut(samples, floor.slope.by_state, scale, length)
    moving = np.array(noise.driven_states(model))
    grouped = blocks(samples, windows, drive(samples, nodes, moving), most)
    start = SmoothFitter(samples, grouped, nodes, floor.slope.by_state, floor.sigma, scale)
    nominal = start.fit(model, np.zeros(0))
    return weighted(start, nominal, floor.sigma), floor


def weighted(fitter: SmoothFitter, fit: Fit, sigma: Array) -> SmoothFitter:
    """The fitter with every channel weighted by what a fit leaves of it, noise at least.

    Weighted by noise, a clean encoder beside a noisy rate would decide everything as long as a
    gap is left.
    """
    size = fitter.blocks.windows.index.shape[1]
    count = len(fitter.blocks.windows)
    square = fit.projected[:, : size * len(fitter.sigma)].reshape(count, size, -1) ** 2
    valid = fitter._valid
    # A few windows that no model follows must not set the scale.
    per_window = np.where(valid, square, 0.0).sum(axis=1) / np.maximum(valid.sum(axis=1), 1)
    left = fitter.sigma * np.sqrt(np.quantile(per_window, 0.75, axis=0))
    fresh = dataclasses.replace(fitter, sigma=np.maximum(left, sigma), cap=np.inf)
    costs = (square * (fitter.sigma / fresh.sigma) ** 2).sum(axis=(1, 2))
    cap = ROBUST * max(float(np.quantile(costs, 0.75)), float(np.median(valid.sum(axis=(1, 2)))))
    return dataclasses.replace(fresh, cap=cap)


