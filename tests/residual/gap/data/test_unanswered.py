"""Inputs and states that a simulator cuts off, or makes no use of, are told before the search."""

import dataclasses

import numpy as np
import pytest

from residual.gap import find_gap
from residual.gap.data.examine import findings
from residual.gap.log import look
from residual.trajectories import Trajectory
from sims import Channel, FirstOrderSystem, Parameter
from sims.pendulum_equation import PendulumEquation


class Heater(FirstOrderSystem):
    """Made by this, and asked with subclasses that cut something off."""

    dt = 1.0
    state_channels = (Channel("temperature", "degC", "other", scale=20.0),)
    action_channels = (Channel("power", "1", "input", low=0.0, high=1.0),)
    parameters = {
        "room": Parameter(21.0, "degC", "temperature around"),
        "rise": Parameter(60.0, "degC", "rise at full power"),
        "time_constant": Parameter(60.0, "s", "time constant", low=1.0),
    }

    def power(self, u):
        return u[:, 0]

    def derivative(self, x, u, p):
        return ((p.room + p.rise * self.power(u) - x[:, 0]) / p.time_constant)[:, None]


class Limited(Heater):
    def power(self, u):
        return np.clip(u[:, 0], 0.0, 0.55)


class Cooled(Heater):
    def derivative(self, x, u, p):
        return super().derivative(np.minimum(x, 60.0), u, p)


class Threshold(Heater):
    def power(self, u):
        return np.maximum(u[:, 0] - 0.1, 0.0)


class Narrow(Heater):
    """Cut off on both sides, of a power that is counted from its middle."""

    def power(self, u):
        return np.clip(u[:, 0], -0.3, 0.3)


class Deaf(Heater):
    def power(self, u):
        return np.full(len(u), 0.4)


def heated(seed=0, n=900, noise=0.05):
    rng = np.random.default_rng(seed)
    power = np.repeat(rng.uniform(0, 1, n // 30), 30)[:, None]
    start = np.array([[21.0 + 60 * power[0, 0]]])
    states = Heater().rollout(start, power[None])[0]
    states += noise * rng.standard_normal(states.shape)
    return Trajectory("oven.csv", np.arange(n + 1.0), states, power)


def told(simulator, run):
    return [f for f in findings(simulator, [run]) if f.kind in ("unanswered", "unused")]


@pytest.mark.parametrize("seed", range(3))
def test_a_limit_in_the_simulator_is_told_with_where_it_lies(seed):
    run = heated(seed)
    (power,) = told(Limited(), run)
    assert power.where == "power"
    assert power.numbers["bound"] == pytest.approx(0.55, abs=0.003)
    assert power.numbers["share"] == pytest.approx((run.actions > 0.55).mean(), abs=0.02)
    assert "above 0.55, as if it were cut off there" in power.says
    (temperature,) = told(Cooled(), run)
    assert temperature.where == "temperature"
    assert temperature.numbers["bound"] == pytest.approx(60.0, abs=1.0)


def test_what_answers_everywhere_or_around_zero_only_is_not_told():
    run = heated()
    assert told(Heater(), run) == []
    assert told(Threshold(), run) == []
    times = np.arange(0, 4, 0.02)
    states = np.stack([np.sin(times), np.cos(times)], axis=1)
    torque = 2 * np.sin(3 * times[:-1])[:, None]
    assert told(PendulumEquation(), Trajectory("swing", times, states, torque)) == []


class Strict(Heater):
    """Says so of a command that there cannot be."""

    def power(self, u):
        if u.min() < 0.0 or u.max() > 0.97:
            raise ValueError("no such command")
        return u[:, 0]


def test_a_simulator_is_asked_within_what_was_recorded_only():
    run = heated()
    run.actions[:] = np.clip(run.actions, 0.0, 0.97)
    assert run.actions.max() == 0.97
    assert told(Strict(), run) == []


def test_a_channel_that_is_cut_off_on_both_sides_is_told_twice_and_listed_once():
    run = heated()
    run = dataclasses.replace(run, actions=run.actions - 0.5, states=run.states - 30.0)
    free = Narrow()
    free.action_channels = (Channel("power", "1", "input", low=-1.0, high=1.0),)
    assert [f.where for f in told(free, run)] == ["power", "power"]
    log = look(free, [run], [], None, lambda _: None)
    assert log.cut_off == ("power",)


def test_an_input_that_makes_no_difference_is_told():
    (finding,) = told(Deaf(), heated())
    assert (finding.kind, finding.where) == ("unused", "power")


@pytest.mark.long
def test_nothing_is_certain_while_a_limit_may_be_a_mistake():
    asked = ("actuator_gain", "saturation", "constant_load", "proportional_loss")
    found = find_gap(Limited(), [heated()], effects=asked)
    assert found.cut_off == ("power",)
    named = [v for v in found.verdicts if v.effect]
    assert named
    assert not [v for v in named if v.kind == "confirmed"]
    assert find_gap(Heater(), [heated()], effects=asked).cut_off == ()
