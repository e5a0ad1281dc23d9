"""Changes carried along windows: our compiled loop beside NumPy's products of stacks of matrices.

Run with ``OMP_NUM_THREADS=1 pytest tests/benchmarks/test_carrying_time.py --benchmark-only``. The
sizes are those of an arm with three joints (few and many columns) and of a pendulum.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from residual.gap.data.carrying import carry
from residual.gap.data.windows import Windows

Array = NDArray[np.float64]

#: Windows, samples in each, states, columns.
SIZES = [(100, 17, 6, 7), (100, 17, 6, 90), (100, 60, 2, 40)]


def by_numpy(windows: Windows, jacobians: Array, start: Array, injected: Array) -> Array:
    """The same as ``carry``, with one product of a stack for each step."""
    count, length = windows.index.shape
    response = np.zeros((count, length, len(start), injected.shape[-1]))
    steps, local = jacobians[windows.index], injected[windows.index]
    for k in range(length - 1):
        response[:, k + 1] = steps[:, k] @ response[:, k] + local[:, k]
    return np.clip(np.nan_to_num(response, copy=False), -1e12, 1e12)


@pytest.mark.parametrize("way", [carry, by_numpy])
@pytest.mark.parametrize("size", SIZES)
def test_carrying_time(benchmark: Any, way: Any, size: tuple[int, int, int, int]) -> None:
    count, length, width, columns = size
    rng, rows = np.random.default_rng(0), count * length
    index = np.arange(rows).reshape(count, length)
    windows = Windows(index, np.ones(index.shape, bool), np.zeros(count, int))
    jacobians = np.eye(width) + 0.05 * rng.standard_normal((rows, width, width))
    injected = rng.standard_normal((rows, width, columns))
    given = windows, jacobians, np.zeros((width, 0)), injected
    np.testing.assert_allclose(carry(*given), by_numpy(*given), rtol=1e-9, atol=1e-9)
    benchmark(way, *given)
