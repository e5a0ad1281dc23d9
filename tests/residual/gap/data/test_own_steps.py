"""Simulators whose own steps are too long for what they simulate."""

import numpy as np
import pytest

from residual.gap.data.examine import examine
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter


class Stand(FirstOrderSystem):
    """The thrust of a propeller, which follows its throttle in a tenth of a second."""

    state_channels = (Channel("thrust", "g", "other", scale=300.0),)
    action_channels = (Channel("throttle", "1", "input", low=0.0, high=1.0),)
    parameters = {"time_constant": Parameter(0.1, "s", "of the motor", low=0.01)}
    dt = 4.0

    def derivative(self, x, u, p):
        return ((600.0 * u[:, 0] - x[:, 0]) / p.time_constant)[:, None]


def stair(dt):
    throttle = np.linspace(0.0, 1.0, 12)
    thrust = 600.0 * np.append(0.0, throttle[:-1])
    return Trajectory("stair", dt * np.arange(12), thrust[:, None], throttle[:-1, None])


def test_an_integration_that_runs_away_is_refused_with_the_fix():
    with pytest.raises(ValueError, match=r"steps of 0\.8 s .* Set substeps = (\d+)") as caught:
        examine(Stand(), [stair(4.0)])
    enough = int(str(caught.value).split("substeps = ")[1].split()[0])
    examine(Stand(substeps=enough), [stair(4.0)])
    simulator = Stand(substeps=enough)
    after = simulator.step(np.array([[0.0]]), np.array([[1.0]]))
    assert after[0, 0] == pytest.approx(600.0, rel=0.02)


@pytest.mark.parametrize("dt", [0.05, 0.2, 1.0])
def test_steps_that_are_merely_coarse_are_not(dt):
    examine(Stand(dt=dt), [stair(dt)])
