"""A sensor that counts and does not tell which way, and a zero that no poor simulator hides."""

from __future__ import annotations

import numpy as np
import pytest

from residual.gap import find_gap
from residual.gap.preparation.conventions import otherwise, without_sign
from residual.gap.preparation.prepare import prepare
from residual.trajectories import Trajectory
from sims import Channel, FirstOrderSystem, Parameter
from studies.gap.summary import summary

DT, ROWS = 0.05, 600


class Wheel(FirstOrderSystem):
    """A wheel that a motor turns both ways."""

    dt = DT
    state_channels = (Channel("speed", "rad/s", "rate", scale=20.0),)
    action_channels = (Channel("volts", "V", "input", scale=6.0, low=-12, high=12),)
    parameters = {
        "gain": Parameter(3.0, "rad/(s V)", "speed per volt"),
        "time_constant": Parameter(0.2, "s", "of the motor", low=0.01),
    }

    def derivative(self, x, u, p):
        return ((p.gain * u[:, 0] - x[:, 0]) / p.time_constant)[:, None]


def turned(seed, gain=4.0, only_forwards=False):
    """The wheel's true speed and its command."""
    rng = np.random.default_rng(seed)
    volts = np.repeat(rng.uniform(0.0 if only_forwards else -8.0, 8.0, ROWS // 30), 30)
    speed = Wheel().with_parameters(gain=gain).rollout(np.zeros((1, 1)), volts[None, :-1, None])[0]
    return speed + 0.05 * rng.standard_normal(speed.shape), volts[:-1, None]


def record(seed, size=True, **of):
    speed, volts = turned(seed, **of)
    return Trajectory(f"run {seed}", DT * np.arange(ROWS), np.abs(speed) if size else speed, volts)


@pytest.mark.parametrize(
    ("of", "told"),
    [({}, True), ({"size": False}, False), ({"only_forwards": True}, False)],
    ids=["size", "with its sign", "one way"],
)
def test_a_speed_without_its_sign_is_told(of, told):
    found = without_sign(Wheel(), prepare(Wheel(), [record(1, **of)], 1.0).fitter)
    assert (found is not None) == told
    if found is not None:
        assert (found.changes, found.reason) == (("the sign of speed",), "size")
        assert found.times > 2


@pytest.mark.long
def test_nothing_is_certain_before_its_sign_is_seen():
    offered = ("gain", "viscous_friction", "dead_zone")
    result = find_gap(Wheel(), [record(seed) for seed in (1, 2)], effects=offered, minutes=0.1)
    assert not [verdict for verdict in result.verdicts if verdict.kind == "confirmed"]
    told = " ".join(summary(result).split())
    assert told.startswith("First see whether the log counts as the simulator does: but for the")
    assert "sign of speed, which never goes below zero in the log" in told


class Bead(FirstOrderSystem):
    """A thermocouple that cools in the air of a room."""

    dt = 0.5
    state_channels = (Channel("bead", "degC", "other", scale=5.0),)
    action_channels = (Channel("room", "degC", "input", scale=20.0),)
    parameters = {"time_constant": Parameter(5.0, "s", "of the bead", low=0.1)}

    def derivative(self, x, u, p):
        return ((u[:, 0] - x[:, 0]) / p.time_constant)[:, None]


@pytest.mark.parametrize(
    ("factor", "zero", "unit"), [(1.0, 0.0, None), (1.0, 273.15, "K"), (1.8, 32.0, "degF")]
)
def test_another_zero_is_told_beside_a_simulator_that_is_three_times_too_quick(factor, zero, unit):
    slow = Bead().with_parameters(time_constant=16.0)
    room = np.full((1, 80, 1), 21.6)
    rng = np.random.default_rng(0)
    runs = []
    for start in (28.0, 33.0):
        bead = slow.rollout(np.array([[start]]), room)[0]
        bead += 0.02 * rng.standard_normal(bead.shape)
        runs.append(Trajectory(f"{start}", 0.5 * np.arange(81), factor * bead + zero, room[0]))
    found = otherwise(Bead(), prepare(Bead(), runs, 3.0).fitter)
    assert (found is not None) == (unit is not None)
    if found is not None:
        assert len(found.changes) == 1
        assert found.changes[0].startswith(f"`unit: {unit}` for bead")
