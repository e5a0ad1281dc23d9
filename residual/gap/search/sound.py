"""A set of effects, fitted, if it may be right."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from residual.gap.search.pool import Key
from residual.gap.search.sets import Search

Array = NDArray[np.float64]


def sound(search: Search, key: Key, theta: Array) -> list[Key]:
    """The set, fitted if it was not, or those that stand for it; none if nothing may be right, or
    if one member does again what another does."""
    made = search.add({key: theta})
    return [k for k in dict.fromkeys([key, *made]) if k in search.tried and search.sound(k)]
