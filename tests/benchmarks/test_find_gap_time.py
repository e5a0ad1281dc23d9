"""Processor time of a whole answer of find_gap, from logs to verdicts.

Run with ``OMP_NUM_THREADS=1 pytest tests/benchmarks/test_find_gap_time.py --benchmark-only``. Logs
are SciPy's: 8 records of 250 rows of the pendulum with one hidden effect, and 20 s of an arm with
two joints at 500 Hz whose elbow rubs.
"""

from __future__ import annotations

import time
from typing import Any

import pytest

from residual.gap import find_gap
from sims.pendulum import Pendulum
from sims.pendulum_equation import PendulumEquation
from studies.hidden.data import Truth, make_logs
from studies.hidden.dirty.measure import Sensors, records
from studies.hidden.dirty.systems import nominal
from studies.hidden.dirty.truth import Truth as ArmTruth

EFFECTS = {
    "mass": 0.3, "inertia": 0.3, "viscous_friction": 2e-4, "coulomb_friction": 3e-4,
    "stribeck_friction": 2e-3, "quadratic_drag": 2e-5, "linear_spring": 4e-3, "cogging": 1e-3,
    "backlash": 0.3, "dead_zone": 0.3, "saturation": 2.2, "delay": 0.02, "actuator_lag": 0.05,
    "sensor_offset": 0.1,
}  # fmt: skip


@pytest.mark.parametrize("effect", EFFECTS)
@pytest.mark.parametrize("simulator", [Pendulum, PendulumEquation])
def test_find_gap_time(benchmark: Any, simulator: type[Pendulum], effect: str) -> None:
    logs = make_logs(Truth(**{effect: EFFECTS[effect]}), 11, "strong", "A", 8)
    host = simulator()
    found = benchmark.pedantic(lambda: timed(host, logs), rounds=1, iterations=1)
    benchmark.extra_info.update(found, system=simulator.__name__, hidden=effect, rows=8 * 250)


def test_find_gap_time_of_an_arm(benchmark: Any) -> None:
    truth = ArmTruth(
        "two-link arm", {}, effect="coulomb_friction", where="elbow", strength=0.12, soft=0.01
    )
    logs = records(truth, Sensors(rates=False), "single", 0.002, 20.0, (0,))
    host = nominal("two-link arm", 0.002, False, False)
    found = benchmark.pedantic(lambda: timed(host, logs), rounds=1, iterations=1)
    benchmark.extra_info.update(
        found, system="two joints", hidden="coulomb_friction@elbow", rows=len(logs[0])
    )


def timed(simulator: Any, logs: Any) -> dict[str, Any]:
    """Processor seconds and the first name."""
    begin = time.process_time()
    found = find_gap(simulator, logs, hold="zero")
    first = found.verdicts[0]
    return {
        "processor_seconds": time.process_time() - begin, "named": first.effect, "kind": first.kind
    }  # fmt: skip
