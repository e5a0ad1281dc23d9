"""A log of a million rows is answered with a verdict in less than 2 GB."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sims.pendulum_equation import PendulumEquation

ROOT = Path(__file__).parents[2]
ROWS, GIGABYTES = 1_000_000, 2.0


def measured(path, period):
    """A pendulum heavier than the simulator's, driven by two sines; time, angle, rate, voltage."""
    true = PendulumEquation.true(dt=period)
    values = {name: p.value for name, p in true.parameters.items()}
    drive = values["torque_constant"] / values["resistance"]
    weight = values["mass"] * values["gravity"] * values["length"]
    damping = values["damping"] + drive * values["torque_constant"]

    def voltage(t):
        return 1.5 * np.sin(0.9 * t) + 0.8 * np.sin(2.3 * t + 1)

    def motion(t, x):
        torque = weight * np.sin(x[0]) - damping * x[1] + drive * voltage(t)
        return [x[1], torque / values["inertia"]]

    times = period * np.arange(ROWS)
    # Long records repeat: what is measured is memory, and noise is new everywhere.
    part = min(ROWS, int(600 / period))
    found = solve_ivp(motion, (0, times[part - 1]), [3.0, 0.0], t_eval=times[:part], max_step=0.02)
    rng = np.random.default_rng(0)
    columns = [found.y[0], found.y[1], voltage(times[:part])]
    with path.open("w") as file:
        file.write("run,time,angle,rate,voltage\n")
        for run, start in enumerate(range(0, ROWS, part)):
            rows = min(part, ROWS - start)
            noisy = [c[:rows] + rng.normal(0, s, rows) for c, s in zip(columns, (1e-3, 2e-3, 0.0),
                                                                       strict=True)]  # fmt: skip
            table = np.column_stack([np.full(rows, run), times[:rows], *noisy])
            np.savetxt(file, table, delimiter=",", fmt=["%d", "%.6f", "%.5f", "%.5f", "%.5f"])


@pytest.mark.long
# At 50 ms every sample is a row of the search, and reading alone takes half a minute.
@pytest.mark.parametrize(("period", "minutes"), [(0.001, "0.3"), (0.05, "2")])
def test_a_million_rows_in_two_gigabytes(period, minutes, tmp_path):
    measured(tmp_path / "log.csv", period)
    (tmp_path / "columns.yaml").write_text("trajectory: [run]\n")
    command = [sys.executable, "-m", "studies.find_gap", "--minutes", minutes]
    command += ["--simulator", "sims.pendulum_equation.PendulumEquation"]
    command += ["--logs", str(tmp_path / "log.csv"), "--columns", str(tmp_path / "columns.yaml")]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    done = subprocess.run(
        [*command, "--output", str(tmp_path / "gap")],
        cwd=ROOT, env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024 / 1e9
    print(f"peak {peak:.2f} GB, {before * 1024 / 1e9:.2f} GB before")
    assert peak < GIGABYTES
    answer = json.loads((tmp_path / "gap" / "gap.json").read_text())
    assert any("mass" in str(verdict) for verdict in answer["verdicts"])
