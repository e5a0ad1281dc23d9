"""Errors of open-loop forecasts: any simulator, from measured states, over one horizon.

How inputs run between samples is said by the simulator's input channels.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from residual.trajectories import Trajectory
from sims.host import HostSimulator
from sims.simulator import Array

#: A forecast that leaves its channel by more than this many times its spread is lost; how far
#: it then goes means nothing.
LOST = 100.0


@dataclasses.dataclass(frozen=True)
class Forecasts:
    """Stretches of measured runs that are to be forecast.

    Attributes:
        runs: Measured runs of one sampling time.
        starts: Run and row of every start, shape (n, 2).
        states: Start states, measured or guessed, shape (n, n_physical).
        seen: What was measured from the start on, shape (n, lead + steps + 1, n_physical), NaN
            where it was not.
        lead: Intervals over which the start state is fitted with the simulator under test before
            the forecast begins; 0 to trust the start states.
        limits: Largest error that counts, by channel, shape (n_physical,).
        noise: Standard deviation of each channel's noise, shape (n_physical,).
    """

    runs: tuple[Trajectory, ...]
    starts: NDArray[np.int64]
    states: Array
    seen: Array
    lead: int
    limits: Array
    noise: Array

    @property
    def steps(self) -> int:
        """Sample intervals of each forecast."""
        return self.seen.shape[1] - 1 - self.lead

    def errors(self, simulator: HostSimulator) -> Array:
        """Forecast less measurement after the lead-in, shape (n, steps, n_physical)."""
        try:
            with np.errstate(all="ignore"):  # what runs away is lost
                motion = _Motion(self, simulator)
                states = self._settled(motion) if self.lead else self.states
                path = motion.roll(states, self.lead + self.steps)
        except (ArithmeticError, np.linalg.LinAlgError):
            path = np.full_like(self.seen, np.inf)
        return self._off(path)[:, self.lead + 1 :]

    def _off(self, path: Array) -> Array:
        missing = ~np.isfinite(self.seen[:, : path.shape[1]])
        off = np.where(missing, 0.0, path - np.nan_to_num(self.seen[:, : path.shape[1]]))
        off = np.clip(np.nan_to_num(off, nan=np.inf), -self.limits, self.limits)
        return np.where(missing, np.nan, off)

    def _settled(self, motion: _Motion) -> Array:
        """Start states that fit the lead-in best: Gauss-Newton, all stretches at once."""
        n, width = self.states.shape
        known = np.isfinite(self.seen).any(axis=(0, 1))
        step = 1e-5 * self.limits
        prior = np.where(known, 10 * self.noise, 0.03 * self.limits)
        states = self.states.copy()
        for _ in range(3):
            shifted = np.concatenate(
                [states, *(states + step[j] * np.eye(width)[j] for j in range(width))]
            )
            paths = motion.roll(shifted, self.lead, copies=width + 1)
            paths = paths.reshape(width + 1, n, self.lead + 1, width)
            off = np.nan_to_num(self._off(paths[0]) / self.noise).reshape(n, -1)
            there = np.isfinite(self.seen[:, : self.lead + 1])
            moved = (paths[1:] - paths[0]) / step[:, None, None, None] / self.noise
            slopes = np.where(there, moved, 0.0).reshape(width, n, -1).transpose(1, 2, 0)
            slopes = np.clip(np.nan_to_num(slopes), -1e9, 1e9)
            matrix = slopes.transpose(0, 2, 1) @ slopes + np.diag(prior**-2.0)
            right = np.einsum("nrj,nr->nj", slopes, off) + (states - self.states) / prior**2
            states = states - np.linalg.solve(matrix, right[..., None])[..., 0]
        return states


class _Motion:
    """One simulator under the recorded inputs of a group of forecasts."""

    def __init__(self, group: Forecasts, simulator: HostSimulator) -> None:
        self._simulator = simulator
        driven = [
            simulator.drive(run.actions, run.durations, substeps_of(simulator, run), rises=True)
            for run in group.runs
        ]
        self._inputs = np.concatenate(driven)
        self._durations = np.concatenate([run.durations for run in group.runs])
        offsets = np.cumsum([0, *(len(run) for run in group.runs)])[:-1]
        self._rows = offsets[group.starts[:, 0]] + group.starts[:, 1]
        self._before = np.concatenate([run.actions for run in group.runs])[self._rows]

    def roll(self, states: Array, steps: int, copies: int = 1) -> Array:
        """Open loop from ``copies`` of every start, shape (copies n, steps + 1, n_physical)."""
        simulator = self._simulator
        physical, width = len(simulator.physical_channels), len(simulator.integrated_channels)
        rows, before = np.tile(self._rows, copies), np.tile(self._before, (copies, 1))
        path = np.empty((len(rows), steps + 1, physical))
        path[:, 0] = states
        with np.errstate(all="ignore"):
            state = simulator.augment(simulator.unsense(states), before)[:, :width]
            for k in range(steps):
                state = simulator.integrate(
                    state, self._inputs[rows + k], self._durations[rows + k]
                )
                path[:, k + 1] = simulator.sense(state)[:, :physical]
        return path


def substeps_of(simulator: HostSimulator, run: Trajectory) -> int:
    """Sub-steps for one sample interval, no longer than the simulator's own."""
    longest = float(np.quantile(run.durations, 0.95))
    return max(1, int(np.ceil(simulator.substeps * longest / simulator.dt - 1e-6)))


def plan(
    simulator: HostSimulator,
    runs: Sequence[Trajectory],
    horizon: float,
    lead: float = 0.0,
    most: int = 200,
) -> list[Forecasts]:
    """Forecasts that overlap by half, spread evenly over all runs.

    Args:
        simulator: Gives the channels.
        runs: Measured; a forecast begins where every channel has a value, or, with a lead-in, in
            any row, rates that were not measured being guessed from the positions.
        horizon: In s; a run that is shorter is forecast once, as far as it goes.
        lead: Length of the lead-in in s, five intervals at least; 0 to trust the first row.
        most: Forecasts for each run.

    Returns:
        One group for each number of sub-steps and of intervals.

    Raises:
        ValueError: No row of any run has a value in every channel.
    """
    physical = len(simulator.physical_channels)
    whole_log = np.concatenate([run.states[:, :physical] for run in runs])
    guesses = [_filled(simulator, run) if lead else run.states[:, :physical] for run in runs]
    spread = np.nanstd(np.concatenate(guesses), axis=0)
    limits = LOST * np.where(spread > 0, spread, 1.0)
    noise = np.maximum(_noise(whole_log), 1e-6 * limits)
    grouped: dict[tuple[int, int, int], list[tuple[Trajectory, Array, NDArray[np.int64]]]] = {}
    for run, guess in zip(runs, guesses, strict=True):
        period = float(np.median(run.durations))
        before = max(5, round(lead / period)) if lead else 0
        steps = max(1, min(round(horizon / period), len(run) - before))
        total = before + steps
        whole = np.flatnonzero(np.isfinite(guess).all(axis=1))
        whole = whole[whole + total <= len(run)]
        stride = max(1, steps // 2, -(-len(run) // most))
        wanted = np.arange(0, len(run) - total + 1, stride)
        places = np.searchsorted(whole, wanted)
        starts = np.unique(whole[places[places < len(whole)]])
        if len(starts):
            key = (before, steps, substeps_of(simulator, run))
            grouped.setdefault(key, []).append((run, guess, starts))
    if not grouped:
        raise ValueError("no row of any run has a value in every channel to forecast from")
    found = []
    for (before, steps, _), members in grouped.items():
        total = before + steps
        starts = np.array([(i, row) for i, (*_, rows) in enumerate(members) for row in rows])
        seen = [members[i][0].states[row : row + total + 1, :physical] for i, row in starts]
        states = [members[i][1][row] for i, row in starts]
        own = tuple(run for run, *_ in members)
        found.append(
            Forecasts(own, starts, np.stack(states), np.stack(seen), before, limits, noise)
        )
    return found


def root_mean_squares(simulator: HostSimulator, forecasts: Sequence[Forecasts]) -> dict[str, float]:
    """Root mean square of the error over all forecasts and rows, by measured channel."""
    physical = simulator.physical_channels
    errors = [group.errors(simulator).reshape(-1, len(physical)) for group in forecasts]
    found = np.concatenate(errors)
    return {
        channel.name: float(np.sqrt(np.nanmean(column**2)))
        for channel, column in zip(physical, found.T, strict=True)
        if np.isfinite(column).any()
    }


def relative_error(simulator: HostSimulator, forecasts: Sequence[Forecasts]) -> float:
    """Error as a share of each channel's spread, mean over the measured channels."""
    found = root_mean_squares(simulator, forecasts)
    spread = forecasts[0].limits / LOST
    names = [channel.name for channel in simulator.physical_channels]
    return float(np.mean([value / spread[names.index(name)] for name, value in found.items()]))


def _filled(simulator: HostSimulator, run: Trajectory) -> Array:
    """States with the rates that were not measured, roughly, from their positions."""
    channels = simulator.physical_channels
    names = [channel.name for channel in channels]
    states = np.array(run.states[:, : len(channels)])
    for column, channel in enumerate(channels):
        if channel.rate_of in names and not np.isfinite(states[:, column]).any():
            position = states[:, names.index(str(channel.rate_of))]
            good = np.isfinite(position)
            smooth = np.convolve(
                np.gradient(position[good], run.times[good]), np.ones(3) / 3, "same"
            )
            states[good, column] = smooth
    return states


def _noise(values: Array) -> Array:
    """Standard deviation of the noise of each column, from third differences; 0 if unmeasured."""
    bends = pd.DataFrame(np.abs(np.diff(values, 3, axis=0)))
    return bends.median().fillna(0.0).to_numpy() / (0.6745 * np.sqrt(20))
