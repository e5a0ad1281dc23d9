"""Fit time of every estimator on pendulum differences, beside the peers a user would reach for.

Run with ``OMP_NUM_THREADS=1 pytest tests/benchmarks/test_fit_time.py --benchmark-only``.
Held-out error (RMS error over RMS difference, at states up to a quarter faster than in
training) is in ``extra_info``. scikit-learn's GaussianProcessRegressor has the same kernel and
its default optimizer; it is left out at 15000 points, where every step of that optimizer would
factor and differentiate a matrix of 15000 by 15000. MLPRegressor has the layers of the paper's
net and its defaults otherwise.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from typing import Any

import estimator_data as data
import numpy as np
import pytest
from sklearn.base import clone
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
from sklearn.neural_network import MLPRegressor

from residual.dropout_net import DropoutNet
from residual.gaussian_process import GaussianProcess
from residual.linear import Linear

# Processor time, so that other programs on the machine do not count.
pytestmark = pytest.mark.benchmark(timer=time.process_time)

OURS: dict[str, Any] = {
    "DropoutNet": DropoutNet(random_state=0),
    "GaussianProcess": GaussianProcess(random_state=0),
    "Linear": Linear(degree=3),
}
PEERS: dict[str, Any] = {
    "GaussianProcessRegressor": GaussianProcessRegressor(
        ConstantKernel(1.0, (1e-4, 1e4)) * RBF([2.0] * 4, (1e-2, 1e3))
        + WhiteKernel(1e-2, (1e-10, 1e1)),
        alpha=0.0,
        normalize_y=True,
    ),
    "MLPRegressor": MLPRegressor(hidden_layer_sizes=(400, 400, 400), random_state=0),
}


@pytest.mark.parametrize("points", [400, 3750, 15000])
@pytest.mark.parametrize("name", [*OURS, *PEERS])
def test_fit_time(benchmark: Callable[..., Any], name: str, points: int) -> None:
    if name == "GaussianProcessRegressor" and points == 15000:
        pytest.skip("all rows in every step of its optimizer: hours, and more than 10 GB")
    X, y = data.training(points)
    estimator = (OURS | PEERS)[name]

    def fit(rows: int = points) -> Any:
        with warnings.catch_warnings():
            # The peers warn about bounds reached and about epochs used up.
            warnings.simplefilter("ignore")
            return clone(estimator).fit(X[:rows], y[:rows])

    fit(60)  # torch and gpytorch are imported by the first fit; that is not what is measured

    rounds = 1 if name == "GaussianProcessRegressor" else 3
    model = benchmark.pedantic(fit, rounds=rounds, iterations=1)
    error = data.held_out_error(model)
    benchmark.extra_info.update(estimator=name, points=points, held_out_error=error)  # type: ignore[attr-defined]
    assert np.isfinite(error)
