"""What the data say about themselves, before any physics."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.trajectories import Trajectory
from sims.host import HostSimulator

Array = NDArray[np.float64]


def kinematics(
    simulator: HostSimulator, trajectories: Sequence[Trajectory]
) -> tuple[list[Trajectory], list[str]]:
    """Compare the change of each position with the integral of its measured rate.

    A rate on another scale than its position is a fault of the log, not of the simulator; left
    alone it would be taken for missing physics. It is put on the position's scale.

    Args:
        simulator: Gives the channels.
        trajectories: Measured runs.

    Returns:
        The runs, corrected where needed, and what was found.
    """
    channels = simulator.physical_channels
    names = [channel.name for channel in channels]
    runs, findings = list(trajectories), []
    for column, channel in enumerate(channels):
        if channel.kind != "rate" or channel.rate_of not in names:
            continue
        position = names.index(channel.rate_of)
        scale, error = _scale(runs, position, column, _simpson)
        rough, _ = _scale(runs, position, column, np.trapezoid)
        # Two rules that disagree say that the sampling is too coarse for this check.
        fine = abs(scale - rough) < 0.25 * abs(scale - 1)
        if fine and abs(scale - 1) > max(4 * error, 0.005):
            findings.append(
                f"{channel.rate_of} changes {scale:.4f} times as much as the integral of "
                f"{channel.name}: {channel.name} was multiplied by {scale:.4f}"
            )
            runs = [_multiplied(run, column, scale) for run in runs]
    return runs, findings


def _scale(
    runs: Sequence[Trajectory], position: int, rate: int, rule: Callable[[Array, Array], float]
) -> tuple[float, float]:
    """Change of the position per integral of the rate, with its standard error over stretches."""
    moved, integrals = [], []
    for run in runs:
        x, v = run.states[:, position], run.states[:, rate]
        for a in range(0, len(run) - 7, 8):
            part = slice(a, a + 9)
            if np.isfinite(x[part]).all() and np.isfinite(v[part]).all():
                moved.append(x[part][-1] - x[part][0])
                integrals.append(float(rule(v[part], run.times[part])))
    if len(moved) < 10:
        return np.nan, np.inf
    y, z = np.array(moved), np.array(integrals)
    # Stretches of little motion tell nothing but noise, which would bias the scale down.
    far = np.abs(z) >= np.median(np.abs(z))
    y, z = y[far], z[far]
    scale = float((y @ z) / (z @ z))
    left = (y - scale * z) * z
    return scale, float(np.sqrt(left @ left) / (z @ z))


def _simpson(values: Array, times: Array) -> float:
    steps = np.diff(times)
    if np.ptp(steps) > 0.05 * steps.mean():
        return float(np.trapezoid(values, times))
    weights = np.array([1, 4, 2, 4, 2, 4, 2, 4, 1]) / 3
    return float(steps.mean() * (weights @ values))


def _multiplied(run: Trajectory, column: int, factor: float) -> Trajectory:
    states = np.array(run.states, float)
    states[:, column] *= factor
    return dataclasses.replace(run, states=states)
