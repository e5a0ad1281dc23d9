"""What a remainder is said to look like is something that the log can show."""

import numpy as np
import pytest

from residual.gap.data.samples import Samples
from residual.gap.fitting.adequacy import generic_forces
from residual.trajectories import Trajectory
from sims.pendulum_equation import PendulumEquation


@pytest.mark.parametrize("reach", [0.3, 3.0])
def test_waves_that_an_angle_does_not_run_through_have_no_name(reach):
    times = 0.05 * np.arange(200)
    states = np.stack([reach * np.sin(times), reach * np.cos(times)], axis=1)
    volts = np.sign(np.sin(3 * times[:-1]))[:, None]
    samples = Samples.join([Trajectory("run", times, states, volts)], 1)
    forces, names = generic_forces(PendulumEquation(), samples, states, np.ones(2))
    assert forces.shape == (len(samples), len(names))
    assert ("cos(5 angle)" in names) is (2 * 5 * reach > np.pi)
    assert ("cos(1 angle)" in names) is (2 * reach > np.pi)
    assert {"angle", "rate", "voltage"} <= set(names)


def test_the_sign_of_an_input_that_never_changes_it_has_no_name():
    """And all else is offered as for one that does."""
    times = 0.05 * np.arange(200)
    states = np.stack([np.sin(times), np.cos(times)], axis=1)
    offered = {}
    for low in (0.0, -1.5):
        volts = (low + 1 + np.sin(3 * times[:-1]))[:, None]
        samples = Samples.join([Trajectory("run", times, states, volts)], 1)
        forces, offered[low] = generic_forces(PendulumEquation(), samples, states, np.ones(2))
        assert forces.shape == (len(samples), len(offered[low]))
    assert [name if name != "sign of voltage" else "" for name in offered[-1.5]] == offered[0.0]
    assert "sign of voltage" in offered[-1.5]
