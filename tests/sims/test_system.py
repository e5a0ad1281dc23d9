"""A system says what fits together."""

import dataclasses

import numpy as np
import pytest
from foreign import Foreign

import sims
from sims.equations import EquationOfMotion
from sims.pendulum import Pendulum
from sims.pendulum_equation import PendulumEquation
from sims.protocol import EvaluationProtocol
from sims.simulator import Channel
from sims.system import System
from sims.tasks import SwingUp, Task


def test_parts_that_do_not_fit_are_one_line():
    class Cart(EquationOfMotion):
        state_channels = (
            Channel("cart", "m", "position"),
            Channel("cart rate", "m/s", "rate", rate_of="cart"),
        )
        action_channels = (Channel("push", "N", "input", low=-1.0, high=1.0),)
        dt = 0.05

        def acceleration(self, q, v, u, force, p):
            return u + force

    with pytest.raises(ValueError, match="state channels cart, cart rate, expected angle, rate"):
        System("mixed", Pendulum(), Cart(), SwingUp())
    with pytest.raises(ValueError, match=r"0.02 s, expected 0.05 s"):
        System("slow", Pendulum(), Pendulum(dt=0.02), SwingUp())
    with pytest.raises(ValueError, match="no state channel height, only angle, rate"):
        System("drawn", Pendulum(), Pendulum.true(), SwingUp(), shown=("height",))
    with pytest.raises(ValueError, match="nominal is a dict"):
        System("nothing", {}, Pendulum.true(), SwingUp())
    system = System("pendulum", Pendulum(), Pendulum.true(), SwingUp())
    with pytest.raises(ValueError, match="the simulator has state channels cart"):
        system.with_nominal(Cart())

    class Wrong(Task):
        horizon = 3

        def start(self, rng):
            return np.zeros(2)

        def reward(self, states, actions, next_states):
            return -next_states[:, 5]

    with pytest.raises(ValueError, match=r"Wrong does not fit pendulum \(angle, rate\)"):
        System("task", Pendulum(), Pendulum.true(), Wrong()).check()


def test_what_is_told_of_a_system():
    system = System("mine", Pendulum(), lambda: Foreign(), SwingUp())
    system.check()
    told = system.description()
    assert told["groups"] == {"angle": ["angle"], "rate": ["rate"]}
    assert len(repr(system).splitlines()) <= 2 and "mine" in repr(system)
    assert system.can_learn_on_truth
    assert not System("mine", Pendulum(), Foreign(), SwingUp()).can_learn_on_truth
    leo = System("leo", sims.Leo(), sims.Leo.true(), sims.Walking())
    assert list(leo.channel_groups()) == ["positions", "rates"]


def test_public_names_are_those_that_are_said():
    for name in sims.__all__:
        assert getattr(sims, name).__name__ == name
    with pytest.raises(AttributeError, match="no attribute 'Nothing'"):
        _ = sims.Nothing


def test_a_task_is_a_task_and_actions_have_bounds():
    class Duck:
        horizon = 5

    with pytest.raises(ValueError, match=r"task is a Duck, expected a Task.*sims.Task"):
        System("mine", Pendulum(), Pendulum.true(), Duck())
    free = Pendulum()
    free.action_channels = (Channel("voltage", "V", "input"),)
    with pytest.raises(ValueError, match=r"'voltage' is bounded by -inf and inf.*low= and high="):
        System("mine", free, Foreign, SwingUp()).check()


@pytest.mark.parametrize(
    ("channel", "says"),
    [
        (
            Channel("angle", "deg", "position"),
            "'angle' with unit='deg', expected 'rad'",
        ),
        (Channel("angle", "rad", "position"), "'angle' with angle=False, expected True"),
    ],
)
def test_a_true_simulator_in_other_units_is_refused(channel, says):
    true = Pendulum.true()
    true.state_channels = (channel, *true.state_channels[1:])
    with pytest.raises(ValueError, match=says):
        System("mine", Pendulum(), true, SwingUp())
    true = Pendulum.true()
    true.action_channels = (Channel("voltage", "V", "input", low=-6.0, high=6.0),)
    with pytest.raises(ValueError, match=r"'voltage' with low=-6.0, expected -3.0 as pendulum"):
        System("mine", Pendulum(), true, SwingUp())


@pytest.mark.parametrize(("unit", "refused"), [("1", False), ("mV", True)])
def test_a_command_without_a_unit_is_one_of_any(unit, refused):
    true = Pendulum.true()
    (action,) = true.action_channels
    true.action_channels = (dataclasses.replace(action, unit=unit),)
    if refused:
        with pytest.raises(ValueError, match="'voltage' with unit='mV', expected 'V'"):
            System("mine", Pendulum(), true, SwingUp())
    else:
        System("mine", Pendulum(), true, SwingUp()).check()


def test_policies_see_a_true_simulator_in_the_scales_that_they_learnt_on():
    true = Pendulum.true()
    angle, rate = true.state_channels
    true.state_channels = (angle, Channel("rate", "rad/s", "rate", rate_of="angle", scale=40.0))
    assert rate.scale == 10.0
    env = System("mine", Pendulum(), true, SwingUp()).true_environment()
    seen, info = env.reset(options={"state": [1.0, 5.0]})
    assert seen[2] == 0.5 and info["state"][1] == 5.0
    assert true.state_channels[1].scale == 40.0


def test_a_parameter_for_each_row_is_tried_and_the_remedy_named():
    class Careless(PendulumEquation):
        def acceleration(self, q, v, u, force, p):
            return (force + u - 0.1 * v) / p.mass

    with pytest.raises(ValueError, match=r"mass as one number for each row.*columns.*q\[:, 0\]"):
        System("mine", Careless(), PendulumEquation(), SwingUp()).check()

    class Averaged(PendulumEquation):
        def acceleration(self, q, v, u, force, p):
            mass = p.mass if np.ndim(p.mass) == 0 else p.mass.mean() + 1
            return (force + u - 0.1 * v) / mass

    with pytest.raises(ValueError, match=r"gives other numbers.*np.stack"):
        System("mine", Averaged(), PendulumEquation(), SwingUp()).check()


@pytest.mark.parametrize(("true", "says"), [
    (3, "true is 3 (int), expected a Simulator"),
    (lambda seed: Foreign(), "true cannot be called without arguments"),
])  # fmt: skip
def test_what_makes_no_true_system_is_refused_at_once(true, says):
    with pytest.raises(ValueError) as error:
        System("odd", Pendulum(), true, SwingUp())
    assert says in str(error.value)


def test_a_class_in_place_of_an_object_is_told():
    with pytest.raises(ValueError, match="nominal is the class Pendulum, not an object of it"):
        System("odd", Pendulum, Foreign, SwingUp())


@pytest.mark.parametrize("wrong", [
    {"every": 0}, {"true_episodes": 0}, {"episodes": 1.5}, {"noisy": -1}, {"finalists": True},
    {"visited_stride": 0}, {"visited_seconds": 0.0}, {"visited_seconds": "2 s"},
])  # fmt: skip
def test_a_protocol_that_tests_nothing_is_refused(wrong):
    (name,) = wrong
    with pytest.raises(ValueError, match=f"EvaluationProtocol: {name} is .*expected (a whole|sec)"):
        EvaluationProtocol(**wrong)
    assert EvaluationProtocol(noisy=0, true_episodes=None).noisy == 0
