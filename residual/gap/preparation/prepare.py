"""From trajectories to a fitter: table, windows, blocks, weights of the channels."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.blocks import blocks, drive
from residual.gap.data.samples import Samples, unseen
from residual.gap.data.windows import cut
from residual.gap.fitting import noise
from residual.gap.fitting.contract import Fit, Fitter
from residual.gap.fitting.impacts.prepare import (
    KNOWN_ON,
    NAMED_ON,
    impact_fitter,
    more_windows,
    simple,
    weigh_impacts,
)
from residual.gap.fitting.smooth import LEAD, SmoothFitter
from residual.gap.model import paths
from residual.gap.model.candidates import Candidate
from residual.gap.model.model import Model
from residual.gap.preparation.between_rows import read_closer
from residual.gap.preparation.effort import Effort
from residual.gap.preparation.numerics import (
    enough_for,
    enough_substeps,
    own_substeps,
    stride_for,
)
from residual.logs.faults import grain
from residual.trajectories import Trajectory
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: A window's loss counts by its logarithm beyond so many times the upper quartile of all.
ROBUST = 4.0
#: Smallest noise that is believed, as a share of each state's usual variation.
FINEST = 1e-5
#: Windows that are fitted: where all rows advance at once, and row by row.
AT_ONCE, BY_ROW = 120, 40
#: States in all windows of a row together: every state costs a simulation more.
STATES = 400
#: Sub-steps of a row, ten of the fastest swing that is looked for (``residual.gap.model.reach``).
STEPS = 4
#: Where states are known fits of what strikes the ground are quick, and better than their linear
#: picture; the few periods in which simulators part at an impact leave a few hundredths.
KNOWN_STATES = Effort(5, 4, 1, 3, 3, enough=0.05, partners=4)


@dataclasses.dataclass(frozen=True)
class Prepared:
    """What a search needs.

    Attributes:
        fitter: Channels weighed by what the nominal simulator leaves.
        floor: Noise around it.
        weigh: Weighs the channels anew, see ``residual.gap.search.explain.Weighing``.
        effort: How hard to search.
        horizon: Forecast length in s.
        pool: Which candidates, and trials of them, are worth their cost.
        more: Makes a fitter of more windows, where few are searched and there are more.
    """

    fitter: Fitter
    floor: noise.Noise
    weigh: Callable[[Fitter, Fit], tuple[Fitter, noise.Noise]]
    effort: Effort
    horizon: float
    pool: Callable[[Sequence[Candidate]], list[Candidate]] = list
    more: Callable[[], Fitter] | None = None


def prepare(
    simulator: HostSimulator,
    trajectories: Sequence[Trajectory],
    horizon: float,
    exact: bool = False,
) -> Prepared:
    """Table, windows, blocks and weights for a simulator and its logs.

    Args:
        simulator: The nominal simulator.
        trajectories: What was recorded.
        horizon: Forecast length in seconds.
        exact: Whether states are known to the last digit, so that past an impact no start state
            makes up for what is missing; of what does not strike the ground it is not asked.

    Raises:
        ValueError: Nothing was measured, or every record is too short.
    """
    if simulator.has_contacts:
        most = KNOWN_ON if exact else NAMED_ON
        impacts, around = impact_fitter(simulator, trajectories, horizon, most, exact)
        effort = KNOWN_STATES if exact else Effort(5, 4, 1, 3, 3)
        more = more_windows(simulator, trajectories, horizon, impacts)
        return Prepared(impacts, around, weigh_impacts, effort, horizon, simple, more)
    fitter, floor = smooth_fitter(simulator, trajectories, horizon)
    finest = own_substeps(simulator, trajectories, fitter.samples.stride)

    def weigh(now: Fitter, fit: Fit) -> tuple[Fitter, noise.Noise]:
        assert isinstance(now, SmoothFitter)
        around = floor
        if len(fit.theta):
            # Noise suffers from a large gap, so it is estimated around the better model.
            better = _noise_around(fit, fitter, floor, horizon / (1 - LEAD))
            around = better if (better.sigma <= floor.sigma).all() else floor
        again = weighted(now, fit, around.sigma)
        corrected = fit.model.bind(fit.theta)
        few = enough_for(corrected, simulator, now.samples, now.nodes, again.sigma, finest)
        return again.with_substeps(max(few, now.samples.substeps)), around

    effort = Effort() if simulator.advances_rows_at_once else Effort(5, 1, 1, 3, 4)
    return Prepared(fitter, floor, weigh, effort, horizon)


def finely(ready: Prepared) -> Prepared:
    """The same with sub-steps that are short beside the fastest swing of a flexible part."""
    fitter = ready.fitter
    if not isinstance(fitter, SmoothFitter) or fitter.samples.substeps >= STEPS:
        return ready
    return dataclasses.replace(ready, fitter=fitter.with_substeps(STEPS))


def _noise_around(
    fit: Fit, fitter: SmoothFitter, floor: noise.Floor, seconds: float
) -> noise.Floor:
    corrected = Model(fit.model.bind(fit.theta))
    samples, none = fitter.samples, np.zeros(0)
    nodes = paths.measured(corrected, samples, none)
    scale = corrected.scales(fitter.scale)
    found = noise.estimate(corrected, samples, nodes, none, floor.sigma, scale)
    sigma = np.maximum(found.sigma, _least(samples, fitter.scale))
    return dataclasses.replace(
        found, sigma=noise.with_walks(fit.model.simulator, samples, sigma, seconds)
    )


def smooth_fitter(
    simulator: HostSimulator, trajectories: Sequence[Trajectory], horizon: float
) -> tuple[SmoothFitter, noise.Floor]:
    """A fitter for a system without impacts, weighed by what the nominal simulator leaves."""
    stride = stride_for(trajectories, horizon)
    finest = own_substeps(simulator, trajectories, stride)
    samples = Samples.join(trajectories, finest if stride == 1 else min(finest, stride), stride)
    if not len(samples.measured):
        raise ValueError("no state channel was measured: every value in the trajectories is NaN")
    model = Model(simulator)
    nodes = paths.measured(model, samples, np.zeros(0))
    scale = _scales(simulator, samples, nodes)
    every = model.scales(scale)  # with what effects of the simulator's own remember
    floor = noise.estimate(model, samples, nodes, np.zeros(0), noise.local_noise(samples), every)
    closer = read_closer(simulator, trajectories, floor, stride, every)
    floor = dataclasses.replace(floor, sigma=closer.sigma, error=closer.error)
    seconds = horizon / (1 - LEAD)
    sigma = np.maximum(floor.sigma, _least(samples, scale))
    sigma = noise.with_walks(simulator, samples, sigma, seconds)
    floor = dataclasses.replace(floor, sigma=sigma)
    windows = cut(samples, floor.slope.by_state, every, seconds)
    moving = np.array(noise.driven_states(model))
    most = min(AT_ONCE, STATES // len(scale)) if simulator.advances_rows_at_once else BY_ROW
    grouped = blocks(samples, windows, drive(samples, nodes, moving), most)
    own, slope = nodes[:, : model.physical], floor.slope.by_state
    start = SmoothFitter(samples, grouped, own, slope, floor.sigma, scale)
    nominal = start.fit(model, np.zeros(0))
    fitter = weighted(start, nominal, floor.sigma)
    few = enough_substeps(simulator, samples, nodes, fitter.sigma, finest)
    return fitter.with_substeps(few), floor


def _least(samples: Samples, scale: Array) -> Array:
    """Smallest noise that is believed of every measured channel, (m,): integrators differ by as
    much, and what was rounded errs by as much however fine its steps are beside its range."""
    steps = np.array([grain([samples.seen[:, column]]) for column in samples.measured])
    return np.maximum(FINEST * scale[samples.measured], steps / np.sqrt(12))


def _scales(simulator: HostSimulator, samples: Samples, nodes: Array) -> Array:
    """Typical variation of every state; of what the log says nothing of, at least its scale."""
    channels = simulator.physical_channels
    physical = paths.variation(samples, nodes[:, : len(channels)])
    usual = np.array([channel.scale for channel in channels])
    hidden = unseen(channels, samples.measured)
    return np.where(hidden, np.maximum(physical, usual), physical)


def weighted(fitter: SmoothFitter, fit: Fit, sigma: Array) -> SmoothFitter:
    """The fitter with every channel weighted by what a fit leaves of it, noise at least.

    Weighted by noise, a clean encoder beside a noisy rate would decide everything as long as a
    gap is left.
    """
    count, size = fitter.blocks.windows.index.shape
    square = fit.projected.reshape(count, size, -1) ** 2
    valid = fitter.valid
    # A few windows that no model follows must not set the scale.
    per_window = np.where(valid, square, 0.0).sum(axis=1) / np.maximum(valid.sum(axis=1), 1)
    left = fitter.sigma * np.sqrt(np.quantile(per_window, 0.75, axis=0))
    fresh = dataclasses.replace(fitter, sigma=np.maximum(left, sigma), cap=np.inf)
    costs = (square * (fitter.sigma / fresh.sigma) ** 2).sum(axis=(1, 2))
    cap = ROBUST * max(float(np.quantile(costs, 0.75)), float(np.median(valid.sum(axis=(1, 2)))))
    return dataclasses.replace(fresh, cap=cap)
