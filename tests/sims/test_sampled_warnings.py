"""What is told of a true environment that is not quite the task's."""

import itertools

import gymnasium
import numpy as np
import pytest

from sims import EvaluationProtocol, Pendulum, SwingUp, System
from sims.pendulum_equation import PendulumEquation
from sims.sampled import SampledEnv

NUMBERS = itertools.count()


class Away(gymnasium.Env):
    """The pendulum, which begins at an angle and stops by itself."""

    action_space = gymnasium.spaces.Box(-3.0, 3.0, (1,), np.float64)

    def __init__(self, begins, stops=None, terminates=False):
        self.begins, self.stops, self.terminates = begins, stops, terminates

    def reset(self, seed=None, options=None):
        super().reset(seed=seed)
        self.state, self.steps = np.array([self.begins, 0.0]), 0
        return self.state, {"state": self.state}

    def step(self, action):
        self.state = PendulumEquation.true().step(self.state[None], action[None])[0]
        self.steps += 1
        over = self.steps == self.stops
        ended, cut = over and self.terminates, over and not self.terminates
        return self.state, 0.0, ended, cut, {"state": self.state}


def told(caplog, *given, episodes=2):
    """What is said in some episodes of an environment of a name of its own."""
    kind = type(f"Away{next(NUMBERS)}", (Away,), {})
    for _ in range(episodes):
        env = SampledEnv(kind(*given), Pendulum(), SwingUp())
        env.reset(seed=0)
        over = False
        while not over:
            _, _, terminated, truncated, _ = env.step(np.zeros(1))
            over = terminated or truncated
    return [record.getMessage() for record in caplog.records]


@pytest.mark.parametrize("begins", [
    pytest.param(np.pi, marks=pytest.mark.long), pytest.param(-np.pi, marks=pytest.mark.long), 3.2,
])  # fmt: skip
def test_nothing_is_said_of_one_that_is_as_the_task(caplog, begins):
    assert told(caplog, begins) == []


def test_another_start_is_told_once(caplog):
    (said,) = told(caplog, 1.0)
    assert "begins episodes at angle 1 rad, the task from 3.1" in said


def test_an_early_end_is_told_once_unless_it_is_terminal(caplog):
    assert told(caplog, np.pi, 7, True) == []
    (said,) = told(caplog, np.pi, 7)
    assert f"ended an episode after 7 of {SwingUp().horizon} steps without terminating it" in said


def test_a_system_says_it_before_anything_is_learnt(caplog):
    kind = type("Elsewhere", (Away,), {})
    System("away", Pendulum(), kind(0.5), SwingUp(), EvaluationProtocol()).check()
    assert "Elsewhere begins episodes at angle 0.5 rad" in caplog.text
