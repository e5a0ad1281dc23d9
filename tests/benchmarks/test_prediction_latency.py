"""Latency of mean predictions for 1 and 1024 rows, fitted on 3750 points.

Run with ``OMP_NUM_THREADS=1 pytest tests/benchmarks/test_prediction_latency.py --benchmark-only``.
The model is reached as the corrected simulator reaches it, through ``DifferenceModel``: channel
features, units and checks of the input are part of the time. Peers as in ``test_fit_time.py``,
but the peer Gaussian process is given our length scales, which do not matter here.
"""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable
from typing import Any

import estimator_data as data
import numpy as np
import pytest
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
from sklearn.neural_network import MLPRegressor

from residual.difference import DifferenceModel
from residual.dropout_net import DropoutNet
from residual.gaussian_process import GaussianProcess
from residual.linear import Linear
from sims.pendulum import Pendulum

ESTIMATORS: dict[str, Any] = {
    "DropoutNet": DropoutNet(random_state=0),
    "GaussianProcess": GaussianProcess(random_state=0),
    "Linear": Linear(),
    "GaussianProcessRegressor": GaussianProcessRegressor(
        ConstantKernel(3.0) * RBF([10.0, 4.0, 4.5, 50.0]) + WhiteKernel(1e-6),
        optimizer=None,
        normalize_y=True,
    ),
    "MLPRegressor": MLPRegressor(hidden_layer_sizes=(400, 400, 400), max_iter=20, random_state=0),
}


@functools.cache
def model(name: str) -> DifferenceModel:
    rows, difference = data.observed(3750, seed=0, reach=12.0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return DifferenceModel(ESTIMATORS[name], Pendulum()).fit_difference(
            rows[:, :2], rows[:, 2:], difference
        )


@pytest.mark.parametrize("rows", [1, 1024])
@pytest.mark.parametrize("name", ESTIMATORS)
def test_prediction_latency(benchmark: Callable[..., Any], name: str, rows: int) -> None:
    inputs, difference = data.observed(2000, seed=1, reach=15.0)
    states, actions = inputs[:rows, :2].copy(), inputs[:rows, 2:].copy()
    fitted = model(name)
    benchmark(fitted.predict, states, actions)
    error = fitted.predict(inputs[:, :2], inputs[:, 2:]) - difference
    relative = np.sqrt(np.mean(error**2, axis=0) / np.mean(difference**2, axis=0))
    benchmark.extra_info.update(  # type: ignore[attr-defined]
        estimator=name, rows=rows, points=3750, held_out_error=float(relative.mean())
    )
    assert np.isfinite(relative).all()
