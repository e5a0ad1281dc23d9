"""Whether positions and their measured rates are on one scale."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.logs.checks import Finding
from residual.trajectories import Trajectory
from sims.host import HostSimulator

Array = NDArray[np.float64]


def kinematics(
    simulator: HostSimulator, trajectories: Sequence[Trajectory]
) -> tuple[list[Trajectory], list[Finding]]:
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
            says = (
                f"{channel.rate_of} changes {scale:.4f} times as much as the integral of "
                f"{channel.name}: {channel.name} was multiplied by {scale:.4f}"
            )
            findings.append(Finding("kinematics", channel.name, says, {"scale": scale}, "warning"))
            runs = [_multiplied(run, column, scale) for run in runs]
    return runs, findings


def _scale(
    runs: Sequence[Trajectory], position: int, rate: int, rule: Callable[[Array, Array], float]
) -> tuple[float, float]:
    """Change of the position per integral of the rate, with its standard error over stretches."""
    moved, integrals, noises = [], [], []
    for run in runs:
        x, v = run.states[:, position], run.states[:, rate]
        for a in range(0, len(run) - 7, 8):
            part = slice(a, a + 9)
            if np.isfinite(x[part]).all() and np.isfinite(v[part]).all():
                times = run.times[part]
                moved.append(x[part][-1] - x[part][0])
                integrals.append(float(rule(v[part], times)))
                noises.append((_roughness(x[part], times), _roughness(v[part], times)))
    if len(moved) < 10:
        return np.nan, np.inf
    y, z = np.array(moved), np.array(integrals)
    of_x, of_v = np.median(np.array(noises), axis=0)
    step = float(np.median([np.median(run.durations) for run in runs]))
    # Variance of the change (two readings) and of the integral (eight steps of readings).
    in_y, in_z = max(2 * of_x, 1e-300), max(8 * step**2 * of_v, 1e-300)
    if z @ z < 4 * len(z) * in_z:
        return np.nan, np.inf
    scale = _through_origin(z, y, in_y / in_z)
    left = y - scale * z
    # Both have noise, so the part of the residual that belongs to z goes back to it.
    cleaned = z + left * scale * in_z / (in_y + scale**2 * in_z)
    return scale, float(np.linalg.norm(left * cleaned) / (cleaned @ cleaned))


def _through_origin(z: Array, y: Array, ratio: float) -> float:
    """Slope of y = slope z with noise in both, ``ratio`` of their variances.

    Least squares alone would take noise in z for a smaller slope. Source: Deming, "Statistical
    adjustment of data" (1943), without the constant.
    """
    yy, zz, zy = float(y @ y), float(z @ z), float(z @ y)
    rest = yy - ratio * zz
    return (rest + np.sqrt(rest**2 + 4 * ratio * zy**2)) / (2 * zy)


def _roughness(values: Array, times: Array) -> float:
    """Variance of what a cubic in time leaves."""
    basis = np.vander((times - times.mean()) / max(float(np.ptp(times)), 1e-12), 4)
    rest = values - basis @ np.linalg.lstsq(basis, values, rcond=None)[0]
    return float(rest @ rest) / (len(values) - 4)


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
