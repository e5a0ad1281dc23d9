"""The best that given effects can do: their strengths fitted by the forecasts that judge."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import least_squares

from sims.effects.base import Effect
from sims.host import HostSimulator
from sims.simulator import Array
from studies.judging.forecasts import Forecasts


def fit_effects(
    simulator: HostSimulator,
    effects: Sequence[Effect],
    forecasts: Sequence[Forecasts],
    channels: Sequence[str],
) -> tuple[Effect, ...]:
    """Effects whose strengths make the forecasts of some channels best, in least squares.

    Channels count relative to the nominal simulator's error. Shapes stay as they are given.

    Args:
        simulator: The nominal simulator.
        effects: What is added to it.
        forecasts: See ``studies.judging.forecasts.plan``.
        channels: What is forecast.

    Returns:
        The effects with fitted strengths.
    """
    names = [channel.name for channel in simulator.physical_channels]
    columns = [names.index(channel) for channel in channels]
    weights = np.concatenate(
        [group.errors(simulator)[..., columns].reshape(-1, len(columns)) for group in forecasts]
    )
    weight = np.sqrt(np.nanmean(weights**2, axis=0))
    fields = [(i, field) for i, effect in enumerate(effects) for field in effect.strengths()]
    known = [effect.quantities(simulator) for effect in effects]
    units = np.array([known[i][field].scale for i, field in fields])
    low = np.array([known[i][field].low for i, field in fields]) / units
    high = np.array([known[i][field].high for i, field in fields]) / units

    def bound(x: Array) -> tuple[Effect, ...]:
        values: list[dict[str, float]] = [{} for _ in effects]
        for (i, field), value in zip(fields, x * units, strict=True):
            values[i][field] = float(value)
        return tuple(e.with_values(**v) for e, v in zip(effects, values, strict=True))

    def residuals(x: Array) -> Array:
        changed = simulator.with_effects((*simulator.effects, *bound(x)))
        parts = [(group.errors(changed)[..., columns] / weight).ravel() for group in forecasts]
        return np.nan_to_num(np.concatenate(parts))

    def slopes(x: Array) -> Array:
        here = residuals(x)
        steps = np.diag(np.where(x + 1e-4 < high, 1e-4, -1e-4))
        return np.stack([(residuals(x + h) - here) / h.sum() for h in steps], axis=1)

    x = np.array([0.01 if np.isfinite(known[i][f].nominal) else 1.0 for i, f in fields])
    x = np.clip(x, low, high)
    # Where an effect is told to have several beginnings, the best of them, one after the other.
    for j, (i, field) in enumerate(fields):
        starts = np.array(known[i][field].starts) / units[j]
        if starts.size:
            tried = np.tile(x, (len(starts) + 1, 1))
            tried[:-1, j] = np.clip(starts, low[j], high[j])
            x = tried[int(np.argmin([(residuals(row) ** 2).sum() for row in tried]))]
    found = least_squares(
        residuals, x, slopes, bounds=(low, high), x_scale="jac", max_nfev=40, ftol=1e-6, xtol=1e-6
    )
    return bound(found.x)
