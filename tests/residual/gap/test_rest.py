"""Long rest between short motions: what it hides from residuals, forecasts show."""

from __future__ import annotations

import numpy as np
import pytest

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.effects import ViscousFriction
from sims.pendulum_equation import PendulumEquation

RUNS, SWINGING, REST = 3, 60, 500
#: Enough to be wrong with.
OFFERED = ("viscous_friction", "coulomb_friction", "mass")


def kicked_and_left_alone(load: float) -> list[Trajectory]:
    """Records of a pendulum that is pushed for a moment, swings, and hangs for a long time."""
    rng = np.random.default_rng(0)
    simulator = PendulumEquation()
    logs = []
    for number in range(RUNS):
        # It differs from record to record, so that no set reaches the noise.
        true = simulator.with_effects([ViscousFriction("pivot", (1 + number) * load)])
        volts = np.zeros((1, SWINGING + REST, 1))
        volts[0, :8] = 2.0 + number
        path = true.rollout(np.array([[np.pi, 0.0]]), volts)[0]
        path[:, 0] += 2e-3 * rng.standard_normal(len(path))
        path[:, 1] = np.nan
        logs.append(Trajectory(f"{number}", 0.05 * np.arange(len(path)), path, volts[0]))
    return logs


@pytest.mark.long
def test_a_gap_of_short_motions_is_named_amid_long_rest():
    result = find_gap(PendulumEquation(), kicked_and_left_alone(0.0006), effects=OFFERED)
    first = result.verdicts[0]
    assert (first.kind, first.effect) in {
        ("confirmed", "viscous_friction"), ("ambiguous", "viscous_friction"),
    }  # fmt: skip
    coefficient = first.parameters["coefficient"]
    assert coefficient.low < 0.0012 < coefficient.high
    assert result.gap.after.value < 0.5 * result.gap.before.value
