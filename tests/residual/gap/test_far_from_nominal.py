"""Numbers out of all proportion: believed where they explain what moved, and not otherwise."""

from typing import ClassVar

import numpy as np
import pytest

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter

OFFERED = ["time_constant", "actuator_gain", "viscous_friction"]


class Motor(EquationOfMotion):
    """The angle of a motor that follows its voltage; the data sheet's time constant."""

    dt = 0.005
    state_channels = (
        Channel("angle", "rad", "position", scale=3.0),
        Channel("rate", "rad/s", "rate", rate_of="angle", scale=10.0),
    )
    action_channels = (Channel("drive", "V", "input", scale=6.0, low=-12.0, high=12.0),)
    parameters: ClassVar = {
        "time_constant": Parameter(0.1, "s", "of the speed", low=1e-4),
    }

    def acceleration(self, q, v, u, force, p):
        return ((2.0 * u[:, 0] + force[:, 0] - v[:, 0]) / p.time_constant)[:, None]


def stepped(time_constant, wander=0.0):
    """Angles under steps of 0.1 s; exact between them, but for a speed that wanders."""
    rng = np.random.default_rng(0)
    drive = np.repeat(rng.uniform(-6, 6, 25), 20)
    keep = np.exp(-0.005 / time_constant)
    angle, speed, drift, seen = 0.0, 0.0, 0.0, []
    for volts in drive:
        seen.append(angle)
        over = speed - 2.0 * volts
        angle += 0.005 * (2.0 * volts + drift) + time_constant * over * (1 - keep)
        speed = 2.0 * volts + over * keep
        drift = 0.98 * drift + wander * rng.standard_normal()
    noisy = np.array(seen) + rng.normal(0, 1e-3, len(seen))
    states = np.stack([noisy, np.full(len(seen), np.nan)], axis=1)
    return Trajectory("steps", 0.005 * np.arange(len(seen)), states, drive[:-1, None])


@pytest.mark.parametrize(
    ("wander", "doubts"),
    [
        (0.0, ("extreme",)),
        pytest.param(0.03, ("extreme", "stretched"), marks=pytest.mark.long),
    ],
)
def test_a_motor_that_is_twenty_times_faster_than_its_data_sheet_is_named(wander, doubts):
    found = find_gap(Motor(), [stepped(0.005, wander)], effects=OFFERED)
    first = found.verdicts[0]
    assert (first.kind, first.effect) == ("ambiguous", "time_constant")
    assert first.doubts == doubts
    assert first.parameters["change"].low < -0.095 < first.parameters["change"].high


@pytest.mark.long
def test_it_is_not_believed_where_much_of_the_motion_is_left():
    found = find_gap(Motor(), [stepped(0.005, wander=0.3)], effects=OFFERED)
    assert not any(verdict.effect == "time_constant" for verdict in found.verdicts)
    reasons = [rival.reason for rival in found.evidence if rival.effects == ("time_constant",)]
    assert any("times its nominal value" in reason for reason in reasons)


@pytest.mark.long
def test_what_it_would_do_alone_is_told():
    found = find_gap(Motor(), [stepped(0.005, wander=0.2)], effects=OFFERED)
    assert not any(verdict.effect == "time_constant" for verdict in found.verdicts)
    told = [one.words for one in found.quality if "times its nominal value" in one.words]
    assert [words.startswith("time constant at 0.04") for words in told] == [True], told


def test_nothing_is_said_of_a_parameter_that_does_little():
    found = find_gap(Motor(), [stepped(0.1, wander=0.3)], effects=OFFERED)
    assert not any("times its nominal value" in one.words for one in found.quality)
