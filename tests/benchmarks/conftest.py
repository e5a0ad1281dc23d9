"""Every benchmark on one thread, and what it ran on in its JSON."""

from __future__ import annotations

import importlib
import os
import time
from collections.abc import Iterator
from importlib import metadata
from typing import Any

import pytest
from threadpoolctl import threadpool_limits

PACKAGES = (
    "simgap", "torch", "scikit-learn", "gpytorch", "pymunk", "numpy", "scipy", "numba", "gymnasium",
    "stable-baselines3",
)  # fmt: skip
START = time.perf_counter()


@pytest.fixture(scope="session", autouse=True)
def one_thread_for_all() -> Iterator[None]:
    # The libraries must be loaded to be limited.
    import torch

    for name in ("scipy.linalg", "sklearn.utils"):
        importlib.import_module(name)

    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    with threadpool_limits(1):
        yield
    torch.set_num_threads(threads)


def pytest_benchmark_update_machine_info(config: Any, machine_info: dict[str, Any]) -> None:
    machine_info["packages"] = {name: _version(name) for name in PACKAGES}
    machine_info["load_at_start"] = os.getloadavg()[0]


def pytest_benchmark_update_json(
    config: Any, benchmarks: list[Any], output_json: dict[str, Any]
) -> None:
    output_json["seconds"] = time.perf_counter() - START
    output_json["processor_seconds"] = time.process_time()


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "not installed"
