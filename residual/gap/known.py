"""What is known of a simulator beforehand: its parameters, to a share of each."""

from __future__ import annotations

import numpy as np

from residual.gap.search import Key, Search
from sims.effects.parameter import ParameterChange

#: How well a parameter is taken to be known, as a share of it.
KNOWN = 0.03
#: Units of which the zero means nothing: of 298 K a share is no accuracy.
ANY_ZERO = ("degC", "°C", "K", "degF", "°F")


def size(search: Search, parameter: str) -> float:
    """What a parameter is known to a share of: its value, or, where zero means nothing, the range
    over which the log has that quantity."""
    known = search.simulator.parameters[parameter]
    value = float(np.max(np.abs(known.value)))
    if known.unit not in ANY_ZERO:
        return value
    samples, channels = search.fitter.samples, search.simulator.physical_channels
    columns = [c for c in samples.measured if channels[c].unit in ANY_ZERO]
    spans = [float(np.ptp(seen[np.isfinite(seen)])) for seen in samples.seen[:, columns].T]
    return min(value, max(spans)) if spans else value


def departures(search: Search, key: Key) -> int:
    """How many things of a fitted set are otherwise than was known: each of its effects, and each
    parameter that is off by more than it is known to."""
    fit = search.tried[key]
    own = fit.model.bind(fit.theta).effects[len(fit.model.simulator.effects) :]
    return sum(
        not isinstance(effect, ParameterChange)
        or abs(float(effect.change)) > KNOWN * size(search, effect.parameter)
        for effect in own
    )
