"""Held-out error and processor time of DropoutNet's variants, beside MLPRegressor's at equal time.

    OMP_NUM_THREADS=1 python tests/benchmarks/dropout_net_error.py 3750 --variants default paper

Data and error as in ``test_fit_time.py``. MLPRegressor has the same layers: once with its defaults
(it stops when its loss no longer falls), once without a tolerance for about as many seconds as the
first variant took, once with its ``early_stopping`` for so long at most.
"""

from __future__ import annotations

import argparse
import time
import warnings
from typing import Any

import estimator_data as data
import torch
from sklearn.neural_network import MLPRegressor

from residual import DropoutNet

VARIANTS: dict[str, dict[str, Any]] = {
    "default": {},
    "no-dropout": {"dropout": 0.0},
    "dropout-to-the-end": {"fine_tuning": 0.0},
    "learning-rate-0.01": {"learning_rate": 0.01},
    "batch-256": {"batch_size": 256},
    "paper": {"paper": True},
}


def measure(name: str, model: Any, points: int) -> float:
    """Fit, print a line, and return the seconds."""
    X, y = data.training(points)
    begin = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # epochs used up
        model.fit(X, y)
    seconds = time.process_time() - begin
    print(f"{points:6d}  {name:32s} {seconds:7.2f} s  {data.held_out_error(model):.4f}", flush=True)
    return seconds


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("points", type=int, nargs="+")
    parser.add_argument("--variants", nargs="+", choices=VARIANTS, default=list(VARIANTS))
    chosen = parser.parse_args()
    torch.set_num_threads(1)
    DropoutNet(hidden=(4,)).fit(*data.training(60))  # what a first fit imports is not measured
    for points in chosen.points:
        ours = [
            measure(f"DropoutNet, {name}", DropoutNet(random_state=0, **VARIANTS[name]), points)
            for name in chosen.variants
        ]
        options: dict[str, Any] = {"hidden_layer_sizes": (400, 400, 400), "random_state": 0}
        usual = MLPRegressor(**options)
        seconds = measure("MLPRegressor", usual, points) / usual.n_iter_
        epochs = max(1, round(ours[0] / seconds))
        options |= {"max_iter": epochs, "n_iter_no_change": 10_000}
        measure(f"MLPRegressor, {epochs} epochs", MLPRegressor(**options, tol=0.0), points)
        options |= {"n_iter_no_change": 10, "early_stopping": True}
        measure(f"MLPRegressor, {epochs} epochs, early stop", MLPRegressor(**options), points)


if __name__ == "__main__":
    main()
