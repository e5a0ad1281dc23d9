"""Findings about the data before any physics."""

import numpy as np
import pytest

from residual.gap.quality import kinematics
from residual.trajectories import Trajectory
from sims.pendulum_equation import PendulumEquation
from studies.hidden.data import Truth, make_logs


def swings(factor):
    times = np.linspace(0, 5, 501)
    angle = np.pi + 0.3 * np.sin(4 * times)
    states = np.stack([angle, 1.2 * np.cos(4 * times) * factor], axis=1)
    return [Trajectory("run", times, states, np.zeros((500, 1)))]


def test_a_rate_on_another_scale_is_put_right_and_told():
    runs, findings = kinematics(PendulumEquation(), swings(1 / 1.05))
    assert len(findings) == 1
    assert "1.05" in findings[0]
    np.testing.assert_allclose(runs[0].states, swings(1.0)[0].states, rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("excitation", ["strong", "weak", "policy"])
def test_coarse_sampling_is_no_reason_to_blame_the_sensor(excitation):
    logs = make_logs(Truth(), 3, excitation, "A", 5)
    runs, findings = kinematics(PendulumEquation(), logs)
    assert findings == []
    assert runs == logs


def test_noise_in_the_rate_is_not_taken_for_a_smaller_scale():
    # A wide dead zone leaves little motion, so most of the measured rate is noise.
    logs = make_logs(Truth(dead_zone=0.58), 4, "weak", "A", 15)
    assert kinematics(PendulumEquation(), logs) == (logs, [])
