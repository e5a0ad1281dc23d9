"""Where the nominal simulator fails: by channel, by state and input, by lag, by run."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.samples import Samples
from residual.gap.data.windows import Windows
from residual.gap.fitting.noise import Floor, driven_states
from residual.gap.model.model import Model

if TYPE_CHECKING:
    from residual.gap.fitting.contract import Fit

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class Profile:
    """Missing acceleration against one variable: mean and 95 % band in bins.

    Attributes:
        variable, unit: What it is plotted against.
        target, target_unit: The driven channel and the unit of its missing rate of change.
    """

    variable: str
    unit: str
    target: str
    target_unit: str
    centres: Array
    mean: Array
    low: Array
    high: Array


@dataclasses.dataclass(frozen=True)
class Where:
    """Where the nominal simulator fails.

    Attributes:
        by_channel: Residual over noise for each measured channel.
        profiles: Missing acceleration against states and inputs.
        lags_s: Lags of the input in s.
        lag_correlation: Correlation of the missing acceleration with the input that long ago.
        run_ratio: Residual over noise of each training run, by name.
    """

    by_channel: dict[str, float]
    profiles: tuple[Profile, ...]
    lags_s: Array
    lag_correlation: dict[str, Array]
    run_ratio: dict[str, float]


def locate(
    model: Model, samples: Samples, windows: Windows, nominal: Fit, sigma: Array,
    ratio: Sequence[float], floor: Floor,
) -> Where:  # fmt: skip
    """Tables and profiles of the missing acceleration around the nominal model."""
    channels = model.simulator.physical_channels
    inputs = model.simulator.action_channels
    driven = driven_states(model)
    inside = np.unique(windows.index[windows.inside])
    profiles = []
    for j, column in enumerate(driven):
        target = channels[column]
        force = floor.force[inside, j]
        variables = [
            (c.name, c.unit, floor.nodes[inside, i], c.angle) for i, c in enumerate(channels)
        ]
        variables += [
            (c.name, c.unit, samples.actions[inside, i], False) for i, c in enumerate(inputs)
        ]
        for name, unit, values, angle in variables:
            if angle:
                values = (values + np.pi) % (2 * np.pi) - np.pi
            found = _profile(values, force)
            if found is not None:
                profiles.append(Profile(name, unit, target.name, f"{target.unit}/s", *found))
    lags, correlation = _lags(samples, floor, [c.name for c in inputs])
    count = len(windows)
    freedom = max(1e-9, 1 - nominal.basis.shape[2] * count / max(int(windows.inside.sum()), 1))
    left = nominal.projected.reshape(count, windows.index.shape[1], -1) * sigma / floor.sigma
    cost = (left**2).sum(axis=(1, 2))
    per_run = {}
    for run in np.unique(windows.run):
        own = windows.run == run
        rows = windows.inside[own].sum() * len(samples.measured)
        per_run[samples.names[run]] = float(np.sqrt(cost[own].sum() / (rows * freedom)))
    return Where(
        by_channel={
            channels[c].name: float(r) for c, r in zip(samples.measured, ratio, strict=True)
        },
        profiles=tuple(profiles),
        lags_s=lags,
        lag_correlation=correlation,
        run_ratio=per_run,
    )


def _profile(values: Array, force: Array, bins: int = 12) -> tuple[Array, ...] | None:
    edges = np.unique(np.quantile(values, np.linspace(0, 1, bins + 1)))
    if len(edges) < 3:
        return None
    place = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
    rows = []
    for b in range(len(edges) - 1):
        own = force[place == b]
        if len(own) >= 4:
            # Neighbouring samples share a window's force, so a quarter of them is counted.
            half = 1.96 * own.std(ddof=1) / np.sqrt(len(own) / 4)
            mean = own.mean()
            rows.append((values[place == b].mean(), mean, mean - half, mean + half))
    return tuple(np.array(rows).T) if len(rows) >= 2 else None


def _lags(
    samples: Samples, floor: Floor, names: list[str], most: int = 12
) -> tuple[Array, dict[str, Array]]:
    found = {name: np.zeros(most + 1) for name in names}
    force = floor.force[:, 0] if floor.force.shape[1] else np.zeros(len(samples))
    for j, name in enumerate(names):
        for lag in range(most + 1):
            a, b = [], []
            for start, stop in samples.runs:
                if stop - start > lag + 4:
                    a.append(force[start + lag : stop])
                    b.append(samples.actions[start : stop - lag, j])
            if a:
                x, y = np.concatenate(a), np.concatenate(b)
                if x.std() > 0 and y.std() > 0:
                    found[name][lag] = float(np.corrcoef(x, y)[0, 1])
    return float(np.median(samples.durations)) * np.arange(most + 1.0), found
