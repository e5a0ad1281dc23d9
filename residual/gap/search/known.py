"""What is known of a simulator beforehand: its parameters, to a share of each."""

from __future__ import annotations

import numpy as np

from residual.gap.search.pool import Key
from residual.gap.search.sets import Search
from sims.effects.base import Effect
from sims.effects.parameter import ParameterChange

#: How well a parameter is taken to be known, as a share of it.
KNOWN = 0.03
#: Times that, beyond which a parameter surely is otherwise.
SURELY = 3.0
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


def departures(search: Search, key: Key) -> float:
    """How much of a fitted set is otherwise than was known: one for each of its effects, and for
    each parameter that is off by more than three times what it is known to; less for less."""
    fit = search.tried[key]
    own = fit.model.added(fit.theta)
    return sum(_departure(search, effect) for effect in own)


def parameters(search: Search, key: Key) -> int:
    """How many members of a set are parameters that the simulator declares, or move as one does."""
    own = [[search.candidates[i], *search.twins_of(i)] for i in key]
    return sum(any(isinstance(c.effect, ParameterChange) for c in one) for one in own)


def extent(search: Search, key: Key) -> float:
    """How far all numbers of a fitted set are from nothing, each beside its usual size."""
    own = search.own(key)
    return float(np.abs(own / search.tried[key].model.step[: len(own)]).sum())


def _departure(search: Search, effect: Effect) -> float:
    if not isinstance(effect, ParameterChange):
        return 1.0
    known = KNOWN * size(search, effect.parameter)
    return min(abs(float(effect.change)) / max(SURELY * known, 1e-300), 1.0)
