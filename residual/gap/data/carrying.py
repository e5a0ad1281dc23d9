"""What changes at one row does along the rest of its window, in the linear picture.

Compiled: of 100 windows of 17 samples of 6 states as fast as NumPy's products of stacks of matrices
for 7 columns (0.34 ms), and 8 times as fast for 90 (1.4 and 11.6 ms; tests/benchmarks/
test_carrying_time.py).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.windows import Windows
from sims.compiled import compiled

Array = NDArray[np.float64]

#: Responses beyond it count as it: a trial that runs away stays finite and loses.
MOST = 1e12


def carry(
    windows: Windows, jacobians: Array, start: Array, injected: Array, begun: Array | None = None
) -> Array:
    """Linear response of the states inside every window.

    ``G[k + 1] = A[k] G[k] + injected[k]``, with ``G[0]`` = ``start`` for the first columns.

    Args:
        windows: W windows of up to L samples.
        jacobians: A, shape (n, n_s, n_s), one for every row of the table.
        start: Columns that start as perturbations of the first state, shape (n_s, f).
        injected: Columns that act at every step: (n, n_s, q) for every row of the table, or
            (W, L, n_s, q) for every place in a window.
        begun: What the injected columns have done before the first state, (W, n_s, q).

    Returns:
        shape (W, L, n_s, f + q).
    """
    count, length = windows.index.shape
    width, f = start.shape
    response = np.zeros((count, length, width, f + injected.shape[-1]))
    response[:, 0, :, :f] = start
    if begun is not None:
        response[:, 0, :, f:] = begun
    by_place = injected.ndim == 4
    acting = np.ascontiguousarray(injected if by_place else injected[None])
    _carry(windows.index, np.ascontiguousarray(jacobians), acting, by_place, f, response)
    return response


@compiled
def _carry(
    index: NDArray[np.int64], jacobians: Array, acting: Array, by_place: bool, f: int,
    response: Array,
) -> None:  # fmt: skip
    count, length, width, columns = response.shape
    for w in range(count):
        for k in range(length - 1):
            row = index[w, k]
            for i in range(width):
                for c in range(f, columns):
                    own = acting[w, k, i, c - f] if by_place else acting[0, row, i, c - f]
                    response[w, k + 1, i, c] = own
                for j in range(width):
                    by = jacobians[row, i, j]
                    for c in range(columns):
                        response[w, k + 1, i, c] += by * response[w, k, j, c]
    for w in range(count):
        for k in range(length):
            for i in range(width):
                for c in range(columns):
                    value = response[w, k, i, c]
                    if np.isnan(value):
                        response[w, k, i, c] = 0.0
                    elif not -MOST <= value <= MOST:
                        response[w, k, i, c] = np.copysign(MOST, value)


@compiled
def weighted(response: Array, states: NDArray[np.int64], weights: Array) -> Array:
    """Some states of a response (W, L, n_s, c), times a weight of each (W, L, m): (W, L, m, c)."""
    count, length, many = weights.shape
    found = np.empty((count, length, many, response.shape[3]))
    for w in range(count):
        for k in range(length):
            for m in range(many):
                for c in range(response.shape[3]):
                    found[w, k, m, c] = weights[w, k, m] * response[w, k, states[m], c]
    return found
