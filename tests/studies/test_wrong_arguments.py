"""What a system or a call of the loop is wrongly given is one error that says what to give."""

import dataclasses

import numpy as np
import pytest

from policy import DDPGConfig
from residual import Linear
from sims import Channel
from sims.pendulum_equation import PendulumEquation
from sims.protocol import EvaluationProtocol
from sims.system import System
from sims.tasks import SwingUp
from sims.unsound import Unsound
from studies.learning.budget import Budget
from studies.learning.loop import learn_by_difference
from studies.running.progress import Silent

PARTS = (PendulumEquation(), PendulumEquation.true(), SwingUp(horizon=30))


@pytest.mark.parametrize(
    ("name", "given", "says"),
    [
        ("evaluation", None, r"evaluation is a NoneType, expected an EvaluationProtocol: Eval"),
        ("evaluation", {"every": 500}, r"evaluation is a dict, expected an EvaluationProtocol"),
        ("evaluation", EvaluationProtocol, r"is the class EvaluationProtocol, not an object"),
        ("state_of", 5, r"state_of is 5 \(int\), expected a function state_of\(env, observation\)"),
        ("measures", lambda s: 3, r"expected a function measures\(states, actions\): too many"),
        ("elsewhere", "x", r"expected a function elsewhere\(rng\)"),
    ],
)
def test_parts_of_a_system_of_another_kind(name, given, says):
    with pytest.raises(ValueError, match=says):
        System("mine", *PARTS, **{name: given})


def test_a_name_that_is_none():
    with pytest.raises(ValueError, match=r"name is 5 \(int\), expected a text"):
        System(5, *PARTS)


def test_an_action_that_can_only_be_one_thing():
    still = PendulumEquation()
    still.action_channels = (Channel("voltage", "V", "input", low=1.0, high=1.0),)
    true = PendulumEquation.true()
    true.action_channels = still.action_channels
    with pytest.raises(Unsound, match="'voltage' can only be 1: give its Channel a low= below"):
        System("mine", still, true, PARTS[2]).check()


def learn(system=None, **given):
    arguments = {
        "estimator": Linear(), "ddpg": DDPGConfig(hidden=(8, 8), warm_up=50, batch=8),
        "progress": Silent(), "evaluation": EvaluationProtocol(every=60, true_episodes=1), **given,
    }  # fmt: skip
    return learn_by_difference(*(system or PARTS), **arguments)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (
            {"samples": 200, "budget": Budget(control_steps=500)},
            r"samples=200, updates=2 .* beside a budget, which has its own \(3750, 2, 20000\)",
        ),
        ({"samples": 60.5}, r"true_samples is 60.5, expected a whole number from 2"),
        ({"updates": True}, r"iterations is True, expected a whole number from 0"),
        ({"replay": "some"}, r"replay is 'some', expected one of \('first', 'all'\)"),
        ({"uncertainty_penalty": -1.0}, r"uncertainty_penalty is -1.0, expected a number from 0"),
        ({"uncertainty_penalty": np.nan}, r"uncertainty_penalty is nan"),
        ({"uncertainty_penalty": "a"}, r"uncertainty_penalty is 'a'"),
    ],
)
def test_arguments_of_the_loop(given, says):
    with pytest.raises(ValueError, match=says):
        learn(**given)


def test_a_file_is_no_folder_to_keep_in(tmp_path):
    file = tmp_path / "kept.py"
    file.write_text("")
    with pytest.raises(ValueError, match=r"kept.py, which is a file: give a folder"):
        learn(keep=file)


@pytest.mark.parametrize(
    ("measures", "says"),
    [
        (lambda states, actions: {"far": np.abs(states[:, 0])}, "expected one number for each"),
        (lambda states, actions: 3, "measures returned 3, expected one number for each name"),
        (lambda states, actions: {"far": states[0, 9]}, "measures raised IndexError"),
    ],
)
def test_measures_that_are_no_numbers_by_name(monkeypatch, measures, says):
    whole = System("mine", *PARTS, EvaluationProtocol(every=60, true_episodes=1))
    system = dataclasses.replace(whole, measures=measures)
    from studies.learning.testing import test_on_truth

    class Still:
        def act(self, observation):
            return np.zeros(1)

    with pytest.raises(Unsound, match=says):
        test_on_truth(system, Still(), 0)
