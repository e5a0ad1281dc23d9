"""The falling phone, whose start speed and sensor offset are not in the log.

Both are fitted for each trial, on its first half; the second half judges.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize_scalar

from residual.trajectories import Trajectory
from sims.effects import QuadraticDrag
from sims.host import HostSimulator
from sims.simulator import Array


def speed_change_error(simulator: HostSimulator, trials: Sequence[Trajectory]) -> float:
    """Root mean square over trials of the error of the speed change over the second half, m/s."""
    misses, times = _accelerations_missed(simulator, trials, 0.5)
    late = [len(miss) // 2 for miss in misses]
    changes = [m[k:] @ t[k:] for m, t, k in zip(misses, times, late, strict=True)]
    return float(np.sqrt(np.mean(np.square(changes))))


def fit_drag(simulator: HostSimulator, trials: Sequence[Trajectory]) -> QuadraticDrag:
    """The drag that all trials share, each with a start speed and an offset of its own."""

    def cost(coefficient: float) -> float:
        changed = simulator.with_effects([QuadraticDrag("phone", coefficient)])
        misses, _ = _accelerations_missed(changed, trials, 1.0)
        return float(sum(miss @ miss for miss in misses))

    found = minimize_scalar(cost, bounds=(0.0, 0.3), method="bounded", options={"xatol": 1e-4})
    return QuadraticDrag("phone", float(found.x))


def _accelerations_missed(
    simulator: HostSimulator, trials: Sequence[Trajectory], part: float
) -> tuple[list[Array], list[Array]]:
    """Simulated less felt acceleration, and steps in s, of every trial.

    The start speed and a constant offset are fitted by Gauss-Newton on the first ``part``.
    """
    steps = [trial.durations for trial in trials]
    felt = [np.diff(trial.states[:, 1]) / trial.durations for trial in trials]
    longest = max(map(len, steps))
    times = np.stack([np.pad(s, (0, longest - len(s)), mode="edge") for s in steps])

    def missed(speeds: Array) -> list[Array]:
        state = np.stack([np.zeros_like(speeds), speeds], axis=1)
        state = simulator.unsense(state)
        path = [simulator.sense(state)[:, 1]]
        for k in range(longest):
            inputs = np.empty((len(state), simulator.substeps, 0))
            state = simulator.integrate(state, inputs, times[:, k])
            path.append(simulator.sense(state)[:, 1])
        simulated = np.diff(np.stack(path, axis=1), axis=1) / times
        return [row[: len(own)] - own for row, own in zip(simulated, felt, strict=True)]

    def centred(values: Array, count: int) -> Array:
        return values - values[:count].mean()

    counts = [max(5, int(part * len(own))) for own in felt]
    # Thrown up or dropped: drag depends on the speed squared, so the search needs a beginning.
    grid = np.arange(-3.0, 8.1, 0.5)
    tried = [missed(np.full(len(trials), speed)) for speed in grid]
    costs = [[_size(centred(m, n)[:n]) for m, n in zip(t, counts, strict=True)] for t in tried]
    starts = grid[np.argmin(costs, axis=0)]
    for _ in range(8):
        here, ahead = missed(starts), missed(starts + 0.01)
        moves = []
        for a, b, count in zip(here, ahead, counts, strict=True):
            miss = centred(a, count)[:count]
            slope = (centred(b, count)[:count] - miss) / 0.01
            size = _size(slope)
            moves.append(-float(slope @ miss) / size if size > 1e-12 else 0.0)
        starts = starts + np.clip(moves, -2.0, 2.0)
    ends = [centred(m, count) for m, count in zip(missed(starts), counts, strict=True)]
    return ends, steps


def _size(values: Array) -> float:
    return float(values @ values)
