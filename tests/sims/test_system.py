"""A system says what fits together, and another library's environment is sampled as ours are."""

import gymnasium
import numpy as np
import pytest

import sims
from sims.equations import EquationOfMotion
from sims.pendulum import Pendulum
from sims.pendulum_equation import PendulumEquation
from sims.sampled import SampledEnv
from sims.simulator import Channel, wrap
from sims.system import System
from sims.tasks import SwingUp, Task


class Foreign(gymnasium.Env):
    """The true pendulum as somebody else wrote it: angles cut at half a turn, states hidden."""

    action_space = gymnasium.spaces.Box(-3.0, 3.0, (1,), np.float32)
    observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (2,), np.float64)

    def __init__(self, report=True, dt=0.05, ends_after=None):
        self.report, self.dt, self.ends_after = report, dt, ends_after

    def _seen(self):
        cut = np.array([wrap(self.state[0]), self.state[1]])
        return cut, {"state": cut} if self.report else {}

    def reset(self, seed=None, options=None):
        super().reset(seed=seed)
        self.state, self.steps = np.array([3.1, self.np_random.uniform(0, 0.1)]), 0
        return self._seen()

    def step(self, action):
        assert action.dtype == np.float32
        self.state = PendulumEquation.true().step(self.state[None], action[None])[0]
        self.steps += 1
        return self._seen()[0], -99.0, self.steps == self.ends_after, False, self._seen()[1]


def episode(env, steps, push):
    """States and rewards under a constant action."""
    _, info = env.reset(seed=4)
    states, rewards, ended = [info["state"]], [], False
    while len(rewards) < steps and not ended:
        _, reward, terminated, truncated, info = env.step(np.array([push]))
        ended = terminated or truncated
        states.append(info["state"])
        rewards.append(reward)
    return np.array(states), np.array(rewards)


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
        sims.Nothing  # noqa: B018
