"""Errors of open-loop forecasts: any simulator, from measured states, over one horizon.

How inputs run between samples is said by the simulator's input channels.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.trajectories import Trajectory
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: A forecast that leaves its channel by more than this many times its spread is lost; how far
#: it then goes means nothing.
LOST = 100.0


@dataclasses.dataclass(frozen=True)
class Forecasts:
    """Stretches of measured runs that are to be forecast from their first state.

    Attributes:
        runs: Measured runs of one sampling time.
        starts: Run and row of every start, shape (n, 2).
        states: Start states, shape (n, n_physical).
        seen: What was measured from the start on, shape (n, steps + 1, n_physical), NaN where it
            was not.
        limits: Largest error that counts, by channel, shape (n_physical,).
    """

    runs: tuple[Trajectory, ...]
    starts: NDArray[np.int64]
    states: Array
    seen: Array
    limits: Array

    @property
    def steps(self) -> int:
        """Sample intervals of each forecast."""
        return self.seen.shape[1] - 1

    def roll(self, simulator: HostSimulator) -> Array:
        """What a simulator forecasts, shape (n, steps + 1, n_physical)."""
        driven = []
        durations = []
        for run in self.runs:
            substeps = substeps_of(simulator, run)
            driven.append(simulator.drive(run.actions, run.durations, substeps, rises=True))
            durations.append(run.durations)
        offsets = np.cumsum([0, *(len(run) for run in self.runs)])[:-1]
        inputs, times = np.concatenate(driven), np.concatenate(durations)
        rows = offsets[self.starts[:, 0]] + self.starts[:, 1]
        before = np.concatenate([run.actions for run in self.runs])[rows]
        physical = len(simulator.physical_channels)
        width = len(simulator.integrated_channels)
        with np.errstate(all="ignore"):
            state = simulator.augment(simulator.unsense(self.states), before)[:, :width]
            path = np.empty((len(rows), self.steps + 1, physical))
            path[:, 0] = self.states
            for k in range(self.steps):
                state = simulator.integrate(state, inputs[rows + k], times[rows + k])
                path[:, k + 1] = simulator.sense(state)[:, :physical]
        return path

    def errors(self, simulator: HostSimulator) -> Array:
        """Forecast less measurement after the start, shape (n, steps, n_physical)."""
        try:
            path = self.roll(simulator)
        except (ArithmeticError, np.linalg.LinAlgError):
            path = np.full_like(self.seen, np.inf)
        missing = ~np.isfinite(self.seen)
        off = np.where(missing, 0.0, path - np.nan_to_num(self.seen))[:, 1:]
        off = np.nan_to_num(off, nan=np.inf)
        off = np.clip(off, -self.limits, self.limits)
        return np.where(missing[:, 1:], np.nan, off)


def substeps_of(simulator: HostSimulator, run: Trajectory) -> int:
    """Sub-steps for one sample interval, no longer than the simulator's own."""
    longest = float(np.quantile(run.durations, 0.95))
    return max(1, int(np.ceil(simulator.substeps * longest / simulator.dt - 1e-6)))


def plan(
    simulator: HostSimulator,
    runs: Sequence[Trajectory],
    horizon: float,
    most: int = 200,
) -> list[Forecasts]:
    """Forecasts that overlap by half, spread evenly over all runs.

    Args:
        simulator: Gives the channels.
        runs: Measured; a forecast begins where every physical channel has a value.
        horizon: In s; a run that is shorter is forecast once, as far as it goes.
        most: Forecasts for each run.

    Returns:
        One group for each number of sub-steps and of intervals.

    Raises:
        ValueError: No row of any run has a value in every channel.
    """
    physical = len(simulator.physical_channels)
    spread = np.nanstd(np.concatenate([run.states[:, :physical] for run in runs]), axis=0)
    limits = LOST * np.where(spread > 0, spread, 1.0)
    grouped: dict[tuple[int, int], list[tuple[Trajectory, NDArray[np.int64]]]] = {}
    for run in runs:
        steps = max(1, min(round(horizon / float(np.median(run.durations))), len(run)))
        whole = np.flatnonzero(np.isfinite(run.states[:, :physical]).all(axis=1))
        whole = whole[whole + steps <= len(run)]
        stride = max(1, steps // 2, -(-len(run) // most))
        wanted = np.arange(0, len(run) - steps + 1, stride)
        places = np.searchsorted(whole, wanted)
        starts = np.unique(whole[places[places < len(whole)]])
        if len(starts):
            grouped.setdefault((steps, substeps_of(simulator, run)), []).append((run, starts))
    if not grouped:
        raise ValueError("no row of any run has a value in every channel to forecast from")
    found = []
    for (steps, _), members in grouped.items():
        own = tuple(run for run, _ in members)
        starts = np.array([(i, row) for i, (_, rows) in enumerate(members) for row in rows])
        seen = np.stack([own[i].states[row : row + steps + 1, :physical] for i, row in starts])
        found.append(Forecasts(own, starts, seen[:, 0], seen, limits))
    return found


def root_mean_squares(simulator: HostSimulator, forecasts: Sequence[Forecasts]) -> dict[str, float]:
    """Root mean square of the error over all forecasts and rows, by channel, in its unit."""
    physical = simulator.physical_channels
    errors = [group.errors(simulator).reshape(-1, len(physical)) for group in forecasts]
    squares = np.nanmean(np.concatenate(errors) ** 2, axis=0)
    return {c.name: float(np.sqrt(s)) for c, s in zip(physical, squares, strict=True)}
