"""From logs of a system that strikes the ground to a fitter."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.blocks import blocks, drive
from residual.gap.data.samples import Samples
from residual.gap.data.windows import Windows
from residual.gap.fitting.contract import Fit, Fitter
from residual.gap.fitting.impacts.ahead import Ahead, units
from residual.gap.fitting.impacts.fitter import LOST, ImpactFitter
from residual.gap.fitting.impacts.noise import quieten, spread, with_noise
from residual.gap.fitting.impacts.single_shooting import StartFit, WindowData, foretold
from residual.gap.fitting.impacts.windows import lay_out, pieces, scales, steps_for
from residual.gap.fitting.noise import Noise
from residual.gap.model import paths
from residual.gap.model.candidates import Candidate
from residual.gap.model.model import Model
from residual.trajectories import Trajectory
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: Windows that effects are searched on, each of which costs a simulation for every state and every
#: effect; and those that decide between sets which these leave open.
NAMED_ON, DECIDED_ON = 40, 120
#: Windows of an interval, of states that are known.
KNOWN_ON = 200
#: Times as many windows that are worth another look.
WORTH = 1.5


def impact_fitter(
    simulator: HostSimulator,
    trajectories: Sequence[Trajectory],
    horizon: float,
    most: int,
    exact: bool = False,
) -> tuple[ImpactFitter, Noise]:
    """A fitter of at most so many windows, weighed by the noise around the nominal simulator.

    ``exact``: states are known to the last digit, those that windows begin at, too.
    """
    longest = max(float(np.quantile(t.durations, 0.95)) for t in trajectories)
    substeps = max(1, int(np.ceil(simulator.substeps * longest / simulator.dt - 1e-6)))
    samples = Samples.join(trajectories, substeps)
    model, none = Model(simulator), np.zeros(0)
    nodes = paths.measured(model, samples, none)
    rates = np.array([i for i, c in enumerate(simulator.physical_channels) if c.kind == "rate"])
    cut = pieces(samples, 1 if exact else steps_for(samples, horizon))
    grouped = blocks(samples, Windows.cut(cut), drive(samples, nodes, rates), most)
    scale = scales(simulator)
    data = lay_out(simulator, samples, grouped.windows.pieces, exact)
    data, fitted = quieten(model, none, data, scale)
    ahead = max(1, round(horizon / samples.step))
    if not exact:
        data = dataclasses.replace(data, ahead=_ahead(model, none, data, fitted, ahead))
    free = np.full(len(data.sigma), np.inf)
    fitter = ImpactFitter(data, grouped, ahead, scale, free)
    nominal = fitter.as_fit(model, none, fitted)
    every = np.zeros(len(data), np.int64)
    squares = fitter.foretell(model, none[None], every, nominal).squares
    limit = LOST * np.nanquantile(squares, 0.75, axis=0)
    return dataclasses.replace(fitter, limit=limit, known=fitted), Noise(
        *spread(data, nominal.inner.fitted)
    )


def _ahead(model: Model, theta: Array, data: WindowData, fitted: StartFit, steps: int) -> Ahead:
    """How forecasts of so many rows count, from fitted windows."""
    starts = fitted.starts
    shown = foretold(model, theta, data, starts, steps)
    moved = np.zeros((*shown.shape, starts.shape[1]))
    for i in np.flatnonzero(~data.known):
        there = starts + data.moves[i] * np.eye(starts.shape[1])[i]
        moved[..., i] = (foretold(model, theta, data, there, steps) - shown) / data.moves[i]
    return Ahead(units(data, shown, fitted.by_start, np.nan_to_num(moved)))


def more_windows(
    simulator: HostSimulator,
    trajectories: Sequence[Trajectory],
    horizon: float,
    fitter: ImpactFitter,
) -> Callable[[], Fitter] | None:
    """What makes a fitter of more windows than one has, if the log holds clearly more."""
    there = len(pieces(fitter.samples, steps_for(fitter.samples, horizon)))
    if min(there, DECIDED_ON) < WORTH * len(fitter.data):
        return None
    return lambda: impact_fitter(simulator, trajectories, horizon, DECIDED_ON)[0]


def weigh_impacts(now: Fitter, fit: Fit) -> tuple[Fitter, Noise]:
    """The windows with the noise around a fit."""
    assert isinstance(now, ImpactFitter)
    sigma, error = spread(now.data, fit.inner.fitted)
    data = with_noise(now.data, sigma, now.scale)
    return dataclasses.replace(now, data=data), Noise(sigma, error)


def simple(pool: Sequence[Candidate]) -> list[Candidate]:
    """One trial for each candidate, and no torque that repeats with the angle (cogging).

    Every trial costs a simulation of all windows, and cogging alone has a dozen for each joint.
    """
    found = []
    for candidate in pool:
        if candidate.name != "cogging":
            middle = candidate.trials[len(candidate.trials) // 2]
            found.append(dataclasses.replace(candidate, trials=(middle,)))
    return found
