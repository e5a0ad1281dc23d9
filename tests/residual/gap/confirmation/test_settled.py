"""What settles from sample to sample shows a curve, and not what makes it."""

from typing import ClassVar

import numpy as np
import pytest

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter


class Fan(FirstOrderSystem):
    """A fan that has settled long before the next row."""

    dt = 0.5
    state_channels = (Channel("speed", "rad/s", "rate", scale=60.0),)
    action_channels = (Channel("duty", "%", "input", scale=50.0, low=-100.0, high=100.0),)
    parameters: ClassVar = {
        "slope": Parameter(1.8, "rad/s/%", "speed per duty", low=0.1),
        "time_constant": Parameter(0.12, "s", "of the motor", low=0.02),
    }

    def derivative(self, x, u, p):
        return ((p.slope * u[:, 0] - x[:, 0]) / p.time_constant)[:, None]


@pytest.mark.parametrize("rows", [pytest.param(168, marks=pytest.mark.long), 280])
def test_a_driver_that_ignores_small_duties_is_not_certainly_dry_friction(rows):
    """It was, in one of these: friction leaves less of the last row's speed."""
    rng = np.random.default_rng(5)
    ramp = np.concatenate([np.arange(1, 71), -np.arange(1, 71)])
    duty = np.tile(ramp, 2)[:rows].astype(float)
    driven = np.sign(duty) * 1.8 * 1.12 * np.maximum(np.abs(duty) - 8.5, 0)
    speed = driven + np.where(driven != 0, rng.normal(0, 0.3, rows), 0.0)
    # Each row holds the speed that its duty has led to.
    run = Trajectory("run", 0.5 * np.arange(rows), speed[:, None], duty[1:, None])
    found = find_gap(Fan(), [run])
    (still,) = (
        v for v in found.verdicts if v.effect in ("coulomb_friction", "dead_zone") and v.parameters
    )
    assert still.kind == "ambiguous"
    both = {still.effect, *(label.partition("@")[0] for label in still.alternatives)}
    assert both >= {"coulomb_friction", "dead_zone"}
