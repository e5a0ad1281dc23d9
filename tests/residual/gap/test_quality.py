"""Findings about the data before any physics."""

import dataclasses

import numpy as np
import pytest

from residual.gap import find_gap
from residual.gap.quality import check_usable, kinematics
from residual.trajectories import Trajectory
from sims.leo import Leo
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


def test_times_in_ms_are_refused():
    (run,) = swings(1.0)
    check_usable(PendulumEquation(), [run])
    slow = dataclasses.replace(run, times=1000 * run.times)
    with pytest.raises(ValueError, match=r"run: a sample every 10 s, .*unit: ms"):
        check_usable(PendulumEquation(), [slow])


def test_a_walk_without_one_encoder_is_refused():
    states = np.full((20, 18), np.nan)
    states[:, :9] = 0.0
    walk = Trajectory("walk", 0.03 * np.arange(20), states, np.zeros((19, 6)))
    check_usable(Leo(), [walk])
    states[:, 5] = np.nan
    with pytest.raises(ValueError, match=r"walk: .*'left_knee' was not logged"):
        check_usable(Leo(), [walk])


def test_no_log_is_refused():
    with pytest.raises(ValueError, match="there are no trajectories"):
        find_gap(PendulumEquation(), [])
