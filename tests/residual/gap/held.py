"""The path of a system under inputs that are held, by SciPy: a stretch of equal inputs at once."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]


def path(
    rates: Callable[[float, Array, float], Sequence[float]],
    start: Sequence[float],
    inputs: Sequence[float] | Array,
    dt: float,
    **options: Any,
) -> Array:
    """States before every row and after the last, shape (n + 1, states).

    A solution for each row of its own takes ten times as long, most of it to begin.
    """
    states = [np.array(start, float)]
    for held, rows in itertools.groupby(inputs):
        times = dt * np.arange(1, len(list(rows)) + 1)
        done = solve_ivp(
            rates, (0.0, times[-1]), states[-1], t_eval=times, args=(held,),
            **{"rtol": 1e-8, **options},
        )  # fmt: skip
        states.extend(done.y.T)
    return np.array(states)
