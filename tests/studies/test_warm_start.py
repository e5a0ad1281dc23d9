"""What was simulated is learnt from again as the newest difference model would have it."""

from types import SimpleNamespace

import numpy as np
import pytest

from policy import DDPG, DDPGConfig
from policy.replay import Replay
from residual import DifferenceModel, Linear
from residual.corrected import CorrectedSimulator
from residual.trajectories import Transitions
from sims.environment import SimulatorEnv
from sims.pendulum import Pendulum
from sims.tasks import SwingUp
from studies.learning.warm_start import Recorder, WarmStart

SMALL = DDPGConfig(hidden=(8, 8), batch=8, warm_up=10_000, replay=20_000)


def correction(seed):
    """A simulator with a difference learnt from random rows of the true pendulum."""
    rng = np.random.default_rng(seed)
    states, actions = rng.uniform(-2, 2, (50, 2)), rng.uniform(-3, 3, (50, 1))
    after = Pendulum.true().step(states, actions)
    data = Transitions(states, actions, after, np.zeros(50, np.int64))
    return CorrectedSimulator(Pendulum(), DifferenceModel(Linear(), Pendulum()).fit(data))


def learnt_in(simulator, steps=300):
    """An agent, and its training with what the simulator below said."""
    env = SimulatorEnv(simulator, SwingUp())
    recorder = Recorder(env)
    agent = DDPG.for_env(env, SMALL)
    agent.learn(recorder, steps)
    simulated = recorder.taken(getattr(simulator, "difference", None))
    return agent, SimpleNamespace(learner=agent, simulated=simulated)


def filled(env, *trainings, **options):
    agent = DDPG.for_env(env, SMALL)
    WarmStart(trainings[-1], "all", trainings).fill(agent, env, **options)
    return agent


def rows(agent):
    return agent.replay.stored()


@pytest.mark.parametrize("simulator", [Pendulum(), correction(0)], ids=["plain", "corrected"])
def test_the_same_simulator_gives_back_the_replay(simulator):
    agent, training = learnt_in(simulator)
    again = filled(SimulatorEnv(simulator, SwingUp()), training)
    np.testing.assert_allclose(rows(again), rows(agent), atol=2e-5)


def test_what_is_recorded_is_the_way_that_was_gone():
    env = Recorder(SimulatorEnv(Pendulum(), SwingUp()))
    assert env.taken() is None
    seen = []
    for episode in range(3):  # more rows than are made room for at once
        state = env.reset(seed=episode)[1]["state"]
        for k in range(3500):
            action = np.array([np.sin(0.01 * k * (episode + 1))], np.float32)
            following = env.step(action)[-1]["state"]
            seen.append((state, action, following))
            state = following
    taken = env.taken()
    for kept, made in zip(vars(taken).values(), zip(*seen, strict=True), strict=True):
        np.testing.assert_array_equal(kept, np.array(made, np.float32))


def test_another_simulator_says_what_it_would_have_done():
    trainings = [learnt_in(simulator)[1] for simulator in (Pendulum(), correction(0))]
    env = SimulatorEnv(correction(1), SwingUp())
    agent = filled(env, *trainings)
    assert len(agent.replay) == WarmStart(trainings[-1], "all", tuple(trainings)).rows == 600
    check_rows(rows(agent), env)


def test_a_simulator_that_is_no_sum_simulates_it_again():
    env, done = SimulatorEnv(Pendulum.true(), SwingUp()), []
    agent = filled(env, learnt_in(Pendulum())[1], again=True, tell=done.append)
    assert done == [300]
    check_rows(rows(agent), env)


def test_the_papers_rule_repeats_the_first_update_as_it_was():
    first = correction(0)
    env = SimulatorEnv(first, SwingUp())
    agent, recorder = DDPG.for_env(env, SMALL), Recorder(env)
    agent.learn(recorder, 300)
    training = SimpleNamespace(learner=agent, simulated=recorder.taken())
    again = DDPG.for_env(env, SMALL)
    newest = SimulatorEnv(correction(1), SwingUp())
    WarmStart(training, "first").then(training).fill(again, newest)
    np.testing.assert_allclose(rows(again), rows(agent), atol=2e-5)


def check_rows(stored, env):
    """Rows of a replay are what the environment does from the same states."""
    for row in stored[::59]:
        state = [np.arctan2(row[1], row[0]), row[2] * Pendulum().state_channels[1].scale]
        env.reset(seed=0, options={"state": state})
        observation, reward, terminated, _, _ = env.step(row[3:4] * env.action_space.high)
        np.testing.assert_allclose(row[6:], observation, atol=2e-5)
        assert row[4] == pytest.approx(0.1 * reward, abs=2e-4)
        assert bool(row[5]) is not terminated


def test_the_replay_keeps_the_last_of_what_it_is_given():
    one, many = Replay(7, 2, 1), Replay(7, 2, 1)
    rng = np.random.default_rng(0)
    for count in (3, 6, 20):
        block = rng.standard_normal((count, 6))
        ended = rng.random(count) < 0.3
        for row, end in zip(block, ended, strict=True):
            one.add(row[:2], row[2:3], row[3], row[4:], bool(end))
        many.extend(block[:, :2], block[:, 2:3], block[:, 3], block[:, 4:], ended)
        assert (len(many), many.position) == (len(one), one.position)
        np.testing.assert_array_equal(many.stored(), one.stored())
