"""What a fit costs as the data grows to 10^5 Leo-sized rows; see ``fit_at_scale.py``."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

SCRIPT = Path(__file__).with_name("fit_at_scale.py")


@pytest.mark.parametrize("points", [1000, 10_000, 100_000])
@pytest.mark.parametrize("name", ["Linear", "GaussianProcess", "DropoutNet"])
def test_fit_at_scale(benchmark: Any, name: str, points: int) -> None:
    environment = os.environ | {"PYTHONPATH": str(SCRIPT.parents[2])}
    command = [sys.executable, str(SCRIPT), name, str(points)]

    def fit() -> dict[str, float]:
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
        return json.loads(done.stdout)

    found = benchmark.pedantic(fit, rounds=1, iterations=1)
    benchmark.extra_info.update(found, estimator=name, points=points)
    assert found["held_out_error"] < 1
