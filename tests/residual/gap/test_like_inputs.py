"""What two inputs of one kind have in common is one effect with one number."""

from typing import ClassVar

import numpy as np
import pytest

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.effects import ActuatorGain, Delay
from sims.effects.library import library
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter

DT, LATE, GAIN = 0.02, 0.06, 0.25


class Rover(FirstOrderSystem):
    """Two wheels, each driven by its own motor; the right one is slower."""

    dt = DT
    state_channels = (
        Channel("left speed", "rad/s", "rate", scale=5.0),
        Channel("right speed", "rad/s", "rate", scale=5.0),
    )
    action_channels = (
        Channel("left", "V", "input", low=-6.0, high=6.0, scale=3.0),
        Channel("right", "V", "input", low=-6.0, high=6.0, scale=3.0),
    )
    parameters: ClassVar = {
        "faster": Parameter(0.15, "s", "time constant of the left wheel", low=0.01),
        "slower": Parameter(0.25, "s", "time constant of the right wheel", low=0.01),
    }

    def derivative(self, x, u, p):
        left = (2.0 * u[:, 0] - x[:, 0]) / p.faster
        return np.stack([left, (2.0 * u[:, 1] - x[:, 1]) / p.slower], axis=1)


def drive(seed, late=(LATE, LATE), gain=(GAIN, GAIN), steps=400):
    """A log by the exact solution from sample to sample."""
    rng = np.random.default_rng(seed)
    volts = np.repeat(rng.uniform(-4, 4, (steps // 20, 2)), 20, axis=0)
    states = np.zeros((steps + 1, 2))
    for j, tau in enumerate((0.15, 0.25)):
        shift = round(late[j] / DT)
        arrived = np.concatenate([np.repeat(volts[:1, j], shift), volts[: steps - shift, j]])
        end = 2.0 * (1 + gain[j]) * arrived
        states[0, j] = end[0]
        for k in range(steps):
            states[k + 1, j] = end[k] + (states[k, j] - end[k]) * np.exp(-DT / tau)
    noisy = states + rng.normal(0, 0.05, states.shape)
    return Trajectory(f"drive {seed}", DT * np.arange(steps + 1), noisy, volts)


def test_one_effect_on_two_inputs_moves_as_one_on_each():
    rng = np.random.default_rng(0)
    actions, start = rng.uniform(-6, 6, (50, 2)), rng.normal(size=2)
    shared = Rover(effects=[Delay("left and right", 0.05), ActuatorGain("left and right", 0.1)])
    each = Rover(
        effects=[
            e for side in ("left", "right") for e in (Delay(side, 0.05), ActuatorGain(side, 0.1))
        ]
    )
    ways = [host.rollout(host.augment(start[None])[0], actions) for host in (shared, each)]
    np.testing.assert_array_equal(*ways)


def test_inputs_are_alike_if_everything_declared_of_them_is():
    places = {effect.where for effect in library(Rover()) if effect.name == "delay"}
    assert places == {"left", "right", "left and right"}
    other = Rover()
    first = Rover.action_channels[0]
    other.action_channels = (first, Channel("right", "V", "input", low=-9.0, high=9.0, scale=3.0))
    assert "left and right" not in {effect.where for effect in library(other)}
    free = [Channel(side, "V", "input", scale=3.0) for side in ("left", "right")]
    other.action_channels = tuple(free)
    assert "left and right" not in {effect.where for effect in library(other)}
    other.action_channels = (first, Channel("right", "N", "input", scale=3.0))
    with pytest.raises(ValueError, match="inputs of several units: V, N"):
        other.with_effects([Delay("left and right", 0.1)])


def named(logs):
    offered = ("delay", "actuator_gain", "actuator_lag", "saturation", "faster", "slower")
    found = find_gap(Rover(), logs, effects=offered)
    assert found.adequate
    return {(v.effect, v.where): v for v in found.verdicts if v.kind in ("confirmed", "ambiguous")}


@pytest.mark.long
def test_what_both_have_is_named_once_and_what_one_has_is_named_there():
    found = named([drive(seed) for seed in range(2)])
    assert set(found) == {("delay", "left and right"), ("actuator_gain", "left and right")}
    (late,) = found["delay", "left and right"].parameters.values()
    assert late.low <= LATE <= late.high
    alone = named([drive(seed, late=(0.0, LATE), gain=(0.0, GAIN)) for seed in range(2)])
    assert set(alone) == {("delay", "right"), ("actuator_gain", "right")}
