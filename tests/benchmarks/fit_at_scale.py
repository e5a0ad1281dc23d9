"""Fit one estimator to Leo-sized rows in a process of its own, so that its peak memory is its own.

    python tests/benchmarks/fit_at_scale.py DropoutNet 100000

prints one line of JSON. The rows are synthetic: 24 inputs from a standard normal distribution
(Leo's states without the way come, angles as cosine and sine, and its voltages), and 18 outputs
y = tanh(X A) B, A of shape (24, 40) with variance 1/24 and B of shape (40, 18) with variance
1/40, each divided by its spread, with noise of 1 % of that added to the training rows only.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from residual import DropoutNet, GaussianProcess, Linear

INPUTS, HIDDEN, OUTPUTS, HELD_OUT = 24, 40, 18, 4000
NOISE = 0.01
ESTIMATORS: dict[str, Any] = {
    "Linear": Linear(),
    "GaussianProcess": GaussianProcess(random_state=0),
    "DropoutNet": DropoutNet(random_state=0),
}

Rows = NDArray[np.float64]


def leo_sized(points: int) -> tuple[Rows, Rows, Rows, Rows]:
    """Training rows (points, 24) and (points, 18), and 4000 held-out rows without noise."""
    random = np.random.default_rng(0)
    first = random.normal(scale=INPUTS**-0.5, size=(INPUTS, HIDDEN))
    second = random.normal(scale=HIDDEN**-0.5, size=(HIDDEN, OUTPUTS))
    held_X, X = (random.normal(size=(n, INPUTS)) for n in (HELD_OUT, points))
    held_y, y = (np.tanh(rows @ first) @ second for rows in (held_X, X))
    spread = held_y.std(axis=0)
    return X, y / spread + NOISE * random.normal(size=y.shape), held_X, held_y / spread


def measure(name: str, points: int) -> dict[str, float]:
    """Wall and processor time of a fit, peak memory of the process, and the held-out error."""
    X, y, held_X, held_y = leo_sized(points)
    ESTIMATORS[name].fit(X[:60], y[:60])  # what a first fit imports is not measured
    wall, processor = time.perf_counter(), time.process_time()
    model = ESTIMATORS[name].fit(X, y)
    wall, processor = time.perf_counter() - wall, time.process_time() - processor
    error = np.sqrt(np.mean((model.predict(held_X) - held_y) ** 2) / np.mean(held_y**2))
    return {
        "fit_seconds": wall,
        "processor_seconds": processor,
        "peak_megabytes": peak_megabytes(),
        "held_out_error": float(error),
    }


def peak_megabytes() -> float:
    """Most memory that this process has held."""
    status = Path("/proc/self/status")
    if status.exists():  # getrusage would count what the parent held when it started this process
        line = next(row for row in status.read_text().splitlines() if row.startswith("VmHWM:"))
        return float(line.split()[1]) / 2**10
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss  # kB; bytes on macOS
    return peak / (2**20 if sys.platform == "darwin" else 2**10)


if __name__ == "__main__":
    torch.set_num_threads(1)
    with threadpool_limits(1):
        print(json.dumps(measure(sys.argv[1], int(sys.argv[2]))))
