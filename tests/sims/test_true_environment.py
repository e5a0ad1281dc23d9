"""Another library's environment is sampled as ours are."""

import gymnasium
import numpy as np
import pytest
from foreign import Foreign, Up, episode

from sims.pendulum import Pendulum
from sims.pendulum_equation import PendulumEquation
from sims.sampled import SampledEnv
from sims.simulator import Channel
from sims.system import System
from sims.tasks import SwingUp


@pytest.fixture
def env():
    return SampledEnv(Foreign(), Pendulum(), SwingUp(horizon=300))


def test_states_are_whole_and_rewards_are_the_tasks(env):
    states, rewards = episode(env, 1000, 3.0)
    assert len(rewards) == 300 and np.abs(np.diff(states[:, 0])).max() < 3
    assert states[:, 0].max() > np.pi + 0.5
    rolled = PendulumEquation.true().rollout(states[0], np.full((300, 1), 3.0))
    np.testing.assert_allclose(states[:100], rolled[:100], atol=1e-6)
    expected = SwingUp().reward(states[:-1], np.full((300, 1), 3.0), states[1:])
    np.testing.assert_allclose(rewards, expected)


def test_the_policy_sees_what_it_sees_of_the_nominal_simulator(env):
    observation, info = env.reset(seed=1)
    angle, rate = info["state"]
    np.testing.assert_allclose(observation, [np.cos(angle), np.sin(angle), rate / 10])
    assert env.observation_space.shape == (3,)


def test_an_episode_ends_where_the_environment_ends_it():
    env = SampledEnv(Foreign(ends_after=7), Pendulum(), SwingUp())
    assert len(episode(env, 1000, 0.0)[1]) == 7


def test_the_state_is_read_by_a_function_if_it_is_not_reported():
    env = SampledEnv(Foreign(report=False), Pendulum(), SwingUp())
    with pytest.raises(ValueError, match="state_of"):
        env.reset()
    env = SampledEnv(
        Foreign(report=False), Pendulum(), SwingUp(), lambda env, o: env.unwrapped.state
    )
    np.testing.assert_array_equal(env.reset(seed=0)[1]["state"], env.env.state)
    short = SampledEnv(Foreign(), Pendulum(), SwingUp(), lambda env, o: o[:1])
    with pytest.raises(ValueError, match=r"shape \(1,\), expected \(2,\): angle, rate"):
        short.reset()


def test_other_actions_or_another_period_are_refused():
    with pytest.raises(ValueError, match=r"voltage from -2 to 2 V.*RescaleAction"):
        gentle = Pendulum()
        gentle.action_channels = (Channel("voltage", "V", "input", low=-2.0, high=2.0),)
        SampledEnv(Foreign(), gentle, SwingUp())
    with pytest.raises(ValueError, match=r"period is 0.1 s.*0.05 s"):
        SampledEnv(Foreign(dt=0.1), Pendulum(), SwingUp())


def test_an_environment_of_the_old_gym_is_named():
    class Old(Foreign):
        def step(self, action):
            return super().step(action)[:4]

    env = SampledEnv(Old(), Pendulum(), SwingUp())
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"Old: step returned 4 values.*terminated, truncated"):
        env.step(np.zeros(1))


@pytest.mark.parametrize("period", [1, np.float32(0.1), np.float64(0.1)])
def test_a_period_of_any_kind_of_number_is_compared(period):
    with pytest.raises(ValueError, match="control period is"):
        SampledEnv(Foreign(dt=period), Pendulum(), SwingUp())
    SampledEnv(Foreign(dt=np.float32(0.05)), Pendulum(), SwingUp())


class Dropping(Foreign):
    """Its third reading is lost."""

    def _seen(self):
        cut, info = super()._seen()
        if self.steps == 2:
            info["state"] = np.array([cut[0], np.nan])
        return cut, info


def test_a_reading_that_is_no_number_names_channel_and_step():
    env = System("mine", Pendulum(), Dropping, SwingUp()).true_environment()
    env.reset(seed=0)
    env.step(np.zeros(1))
    with pytest.raises(ValueError, match="Dropping gave rate = nan rad/s after step 2"):
        env.step(np.zeros(1))


def test_a_reward_or_a_simulator_that_leaves_the_numbers_is_named():
    task = Up(reward=lambda s, a, n: np.where(np.arange(len(n)) >= 0, np.log(-np.abs(n[:, 0])), 0))
    for env in (
        System("mine", Pendulum(), Foreign, task).true_environment(),
        System("mine", Pendulum(), Foreign, task).environment(Pendulum()),
    ):
        env.reset(seed=0)
        with (
            np.errstate(all="ignore"),
            pytest.raises(ValueError, match=r"the reward nan after step 1.*reached was angle"),
        ):
            env.step(np.ones(1))


@pytest.mark.parametrize(("start", "expected"), [(-3.0, 2 * np.pi - 3), (9.0, 9 - 2 * np.pi)])
def test_angles_begin_where_the_tasks_own_starts_are(start, expected):
    class Turned(Foreign):
        def reset(self, seed=None, options=None):
            super().reset(seed=seed)
            self.state = np.array([start, 0.0])
            return self.state, {"state": self.state}

    env = System("mine", Pendulum(), Turned, SwingUp()).true_environment()
    assert env.reset(seed=0)[1]["state"][0] == pytest.approx(expected)


class Seedless(Foreign):
    def reset(self):
        return super().reset()


class OldReset(Foreign):
    def reset(self, seed=None, options=None):
        return super().reset(seed)[0]


class Choices(Foreign):
    action_space = gymnasium.spaces.Discrete(3)


@pytest.mark.parametrize(("made", "says"), [
    (Seedless, "reset(seed=, options=)"),
    (OldReset, "reset returned ndarray, expected Gymnasium's two"),
    (Choices, "policies act in a Box"),
    (lambda: "Pendulum-v1", "returned 'Pendulum-v1' (str), expected a Simulator or a Gymnasium"),
    (lambda: gymnasium.make("Pendulum-v1", max_episode_steps=20), "ends episodes after 20 steps"),
])  # fmt: skip
def test_what_a_true_environment_gets_wrong_is_its_own_line(made, says):
    task = SwingUp(horizon=50)
    nominal = Pendulum()
    if says.startswith("ends"):
        nominal = PendulumEquation()
        nominal.action_channels = (Channel("voltage", "V", "input", low=-2.0, high=2.0),)
    system = System("odd", nominal, made, task)
    with pytest.raises(ValueError) as error:
        system.true_environment().reset(seed=0)
    assert says in str(error.value)


def test_a_reader_of_states_takes_two_arguments():
    with pytest.raises(ValueError, match=r"state_of\(env, observation\)"):
        SampledEnv(Foreign(False), Pendulum(), SwingUp(), lambda observation: observation)
