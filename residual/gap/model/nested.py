"""Sets within sets: where the numbers of a larger one begin, and what is not there at all."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from residual.gap.model.model import Model

Array = NDArray[np.float64]
Key = tuple[int, ...]


def from_nested(
    model: Model, key: Key, theta: Array, inner: Model, nested: Key, own: Array
) -> Array:
    """Numbers of a nested set, what it lacks hardly there, (p,).

    Args:
        model, key: The larger set.
        theta: Its usual start values; those of forms, which have no absence, are kept, (p,).
        inner, nested: The smaller set.
        own: Its fitted numbers, (k,).
    """
    start = np.array(theta)
    for place, number in enumerate(key):
        its = np.flatnonzero(model.owner == place)
        if number in nested:
            start[its] = own[inner.owner == nested.index(number)]
            continue
        for j in its:
            if model.knobs[j].strength:
                start[j] = np.clip(0.01 * model.knobs[j].step, model.low[j], model.high[j])
    return start


def absent(model: Model, key: Key, theta: Array) -> list[int]:
    """Members of a set that are not there: a fit put all their strengths at zero.

    Args:
        model, key: The set.
        theta: Its fitted numbers, (p,).
    """
    found = []
    for place, number in enumerate(key):
        own = [j for j in np.flatnonzero(model.owner == place) if model.knobs[j].strength]
        if own and not theta[own].any():
            found.append(number)
    return found
