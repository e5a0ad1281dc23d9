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
from sims.system import EvaluationProtocol, System
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


def test_an_environment_of_the_old_gym_is_named():
    class Old(Foreign):
        def step(self, action):
            return super().step(action)[:4]

    env = SampledEnv(Old(), Pendulum(), SwingUp())
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"Old: step returned 4 values.*terminated, truncated"):
        env.step(np.zeros(1))


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


class Up(SwingUp):
    """A task whose parts a test replaces."""

    def __init__(self, **parts):
        super().__init__()
        for name, part in parts.items():
            object.__setattr__(self, name, part)


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
            Channel("angle", "deg", "position", angle=True),
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


def test_policies_see_a_true_simulator_in_the_scales_that_they_learnt_on():
    true = Pendulum.true()
    angle, rate = true.state_channels
    true.state_channels = (angle, Channel("rate", "rad/s", "rate", rate_of="angle", scale=40.0))
    assert rate.scale == 10.0
    env = System("mine", Pendulum(), true, SwingUp()).true_environment()
    seen, info = env.reset(options={"state": [1.0, 5.0]})
    assert seen[2] == 0.5 and info["state"][1] == 5.0
    assert true.state_channels[1].scale == 40.0


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
])  # fmt: skip
def test_a_protocol_that_tests_nothing_is_refused(wrong):
    (name,) = wrong
    with pytest.raises(ValueError, match=f"EvaluationProtocol: {name} is .*expected a whole"):
        EvaluationProtocol(**wrong)
    assert EvaluationProtocol(noisy=0, true_episodes=None).noisy == 0
