"""Two lags in a row make one motion, whichever comes first."""

import numpy as np
import pytest
from plate import Plate

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.effects import ActuatorLag


def heated(time_constant, lag):
    """A plate that is heated by steps, and begins at rest."""
    plate = Plate().with_parameters(time_constant=time_constant)
    true = plate.with_effects([ActuatorLag("power", lag)])
    rng = np.random.default_rng(2)
    power = np.concatenate([[0.0] * 40, np.repeat(rng.uniform(0.0, 1.0, 16), 40)])[:, None]
    states = true.rollout(np.zeros(len(true.state_channels)), power)[:, :1]
    states = states + 0.05 * rng.standard_normal(states.shape)
    return Trajectory("run", np.arange(len(states)) * plate.dt, states, power)


@pytest.mark.parametrize(("nominal", "certain"), [(3.0, False), (110.0, True)])
def test_a_drive_that_would_be_the_slower_one_is_not_certain(nominal, certain):
    """A time constant of 120 s, given as 3, makes a lag of 120 s and a time constant of 15."""
    simulator = Plate().with_parameters(time_constant=nominal)
    offered = ["actuator_lag", "time_constant", "constant_load"]
    found = find_gap(simulator, heated(120.0, 15.0), effects=offered).verdicts
    lag, time = (
        next(v for v in found if v.effect == name) for name in ("actuator_lag", "time_constant")
    )
    assert (lag.kind == "confirmed") is certain
    assert ("swapped" in lag.doubts) is ("swapped" in time.doubts) is not certain
