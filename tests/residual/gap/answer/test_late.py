"""A delay of one of two inputs is told to look like late sensors where the other one is slow."""

import dataclasses
from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest

from residual.gap import find_gap
from residual.gap.answer.late import nearly_in_sensors
from residual.gap.preparation.prepare import prepare
from residual.trajectories import Trajectory
from sims.effects import ActuatorGain, ActuatorLag, Delay
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter

DT, LATE = 0.02, 0.06


class Turning(FirstOrderSystem):
    """The yaw rate of a car by its steering angle and speed."""

    dt = DT
    state_channels = (Channel("yaw rate", "rad/s", "rate", scale=0.2),)
    action_channels = (
        Channel("steer", "rad", "input", scale=0.03),
        Channel("speed", "m/s", "input", scale=20.0, low=1.0),
    )
    parameters: ClassVar = {"length": Parameter(2.5, "m", "wheelbase", low=1.0)}

    def derivative(self, x, u, p):
        return ((u[:, 0] * u[:, 1] / p.length - x[:, 0]) / 0.2)[:, None]


def searched(swerves):
    """A search whose log has a speed that changes so often in 20 s."""
    times = DT * np.arange(1000)
    steer = 0.05 * np.sin(4 * times)
    speed = 20 + 5 * np.sin(2 * np.pi * swerves * times / 20)
    inputs = np.stack([steer, speed], axis=1)[:-1]
    states = np.zeros((1000, 1))
    simulator = Turning()
    for k in range(999):
        states[k + 1] = simulator.step(states[k : k + 1], inputs[k : k + 1])[0]
    runs = [Trajectory("run", times, states, inputs)]
    return SimpleNamespace(simulator=simulator, fitter=prepare(simulator, runs, 1.0).fitter), runs


def test_a_simulator_with_a_delay_of_its_own_is_asked_like_any_other():
    """Its states hold what the delay remembers; the log, and what is asked of it, do not."""
    search, (run,) = searched(1)
    search.simulator = Turning(effects=[Delay("steer", LATE)])
    assert nearly_in_sensors([Delay("steer", LATE)], search) == ("delay@steer",)
    memory = np.full((len(run.times), 4), np.nan)
    seen = np.hstack([run.states, memory[:, : len(search.simulator.state_channels) - 1]])
    runs = [dataclasses.replace(run, states=seen)]
    found = find_gap(search.simulator, runs, effects=["delay", "length"], parameter_tolerance=0)
    # The car of this log is never late, and a delay beside the nominal one makes it no earlier.
    assert [e.name for e in found.effects if e.name == "delay"] == []


@pytest.mark.parametrize(("swerves", "told"), [(1, ("delay@steer",)), (40, ())])
def test_late_sensors_nearly_imitate_one_late_input_beside_slow_ones(swerves, told):
    search, (run,) = searched(swerves)
    effects = [Delay("steer", LATE), ActuatorGain("speed", 0.1), ActuatorLag("speed", LATE)]
    assert nearly_in_sensors(effects, search) == told
    # That is what late sensors show, beside the motion of a car whose steering is late.
    late = Turning(effects=[Delay("steer", LATE)])
    state = late.augment(run.states[:1], run.actions[:1])
    off = []
    for k in range(999):
        state = late.step(state, run.actions[k : k + 1])
        off.append(state[0, 0] - run.states[max(k + 1 - 3, 0), 0])
    punctual = np.std(run.states[3:, 0] - run.states[:-3, 0])
    assert bool(np.std(off[50:]) < 0.1 * punctual) == bool(told)
