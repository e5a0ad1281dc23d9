"""The registered environments behave as Gymnasium and its users expect."""

import warnings
from types import MappingProxyType

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import residual
from residual import DifferenceModel, Linear
from residual.trajectories import Transitions
from sims.environment import SimulatorEnv, observe
from sims.pendulum import Pendulum
from sims.simulator import Channel, Simulator
from sims.tasks import SwingUp


@pytest.fixture(scope="module")
def saved_difference(tmp_path_factory):
    rng = np.random.default_rng(0)
    states = rng.uniform([-3, -10], [3, 10], (200, 2))
    actions = rng.uniform(-3, 3, (200, 1))
    data = Transitions(
        states, actions, Pendulum.true().step(states, actions), np.zeros(200, dtype=int)
    )
    path = tmp_path_factory.mktemp("difference") / "difference.safetensors"
    residual.save(DifferenceModel(Linear(), Pendulum()).fit(data), path)
    return path


@pytest.mark.parametrize("name", ["Idealised", "True", "Corrected"])
def test_registered_environments_pass_gymnasiums_checker(name, saved_difference):
    options = {"difference": saved_difference} if name == "Corrected" else {}
    env = gymnasium.make(f"simgap/Pendulum{name}-v0", render_mode="rgb_array", **options)
    with warnings.catch_warnings():
        # Volts are what the motor takes; Gymnasium would prefer a range of one.
        warnings.filterwarnings("ignore", ".*normalized space.*")
        # An episode of a pendulum has no natural bound on its rate.
        warnings.filterwarnings("ignore", ".*(infinity|-infinity).*")
        check_env(env.unwrapped)


def test_an_episode_starts_hanging_and_ends_by_time_after_20_s():
    env = gymnasium.make("simgap/PendulumTrue-v0")
    observation, info = env.reset(seed=0)
    np.testing.assert_allclose(observation, [-1, 0, 0], atol=1e-15)
    np.testing.assert_allclose(info["state"], [np.pi, 0])
    total, steps, truncated = 0.0, 0, False
    while not truncated:
        _, reward, terminated, truncated, _ = env.step(np.zeros(1))
        assert not terminated
        total, steps = total + reward, steps + 1
    assert steps == 400
    # Hanging still costs 5 pi^2 a step: 19 739 in all.
    assert total == pytest.approx(-5 * np.pi**2 * 400, rel=1e-6)


def test_the_reward_counts_the_wrapped_angle_reached_the_rate_and_the_voltage():
    reward = SwingUp().reward(
        np.zeros((1, 2)), np.array([[2.0]]), np.array([[2 * np.pi + 0.5, -3.0]])
    )
    assert reward == pytest.approx(-5 * 0.25 - 0.1 * 9 - 0.01 * 4)


def test_actions_beyond_the_bounds_are_clipped_before_they_are_charged():
    env = SimulatorEnv(Pendulum(), SwingUp())
    env.reset(seed=0)
    beyond = env.step(np.array([50.0]))
    env.reset(seed=0)
    at_bound = env.step(np.array([3.0]))
    assert beyond[1] == at_bound[1]


def test_start_anywhere_is_seeded_and_covers_the_circle():
    env = gymnasium.make("simgap/PendulumTrue-v0", start_at="anywhere")
    starts = np.array([env.reset(seed=seed)[1]["state"] for seed in range(200)])
    again = np.array([env.reset(seed=seed)[1]["state"] for seed in range(200)])
    np.testing.assert_array_equal(starts, again)
    assert starts[:, 0].min() < -2.8 and starts[:, 0].max() > 2.8
    assert np.abs(starts[:, 1]).max() <= 1


def test_pictures_follow_the_state():
    env = gymnasium.make("simgap/PendulumTrue-v0", render_mode="rgb_array")
    env.reset(seed=0)
    hanging = env.render()
    env.reset(options={"state": [0.0, 0.0]})
    upright = env.render()
    assert hanging.shape == (240, 240, 3) and hanging.dtype == np.uint8
    # Upright is hanging turned by half a turn.
    assert np.abs(upright.astype(int) - hanging[::-1].astype(int)).mean() < 2
    assert np.abs(upright.astype(int) - hanging.astype(int)).mean() > 2


def test_memory_channels_are_hidden_from_the_policy():
    class Remembering(Simulator):
        name = "remembering"
        dt = 0.1
        state_channels = (
            Channel("x", "m", "position", scale=2.0),
            Channel("past", "N", "memory"),
        )
        action_channels = (Channel("force", "N", "input", low=-1, high=1),)
        parameters = MappingProxyType({})

        def step(self, states, actions):
            return np.asarray(states)

    seen = observe(Remembering(), np.array([[4.0, 7.0]]))
    np.testing.assert_array_equal(seen, [[2.0]])


def test_a_task_is_shown_no_hidden_memory():
    """Columns of a state unpack by name whatever effects the true system hosts."""
    from sims.effects import ActuatorLag, Delay

    class Named(SwingUp):
        def reward(self, states, actions, next_states):
            (_, rate), (angle, _) = states.T, next_states.T
            return -(angle**2) - rate**2

        def terminal(self, next_states):
            angle, _ = next_states.T
            return np.abs(angle) > 9

    lagging = Pendulum(effects=[Delay("voltage", 0.05), ActuatorLag("voltage", 0.1)])
    env = SimulatorEnv(lagging, Named())
    _, info = env.reset(seed=0)
    _, reward, ended, _, after = env.step(np.array([2.0]))
    assert len(info["state"]) > 2 and not ended
    assert reward == pytest.approx(-(after["state"][0] ** 2) - info["state"][1] ** 2)


def test_a_simulator_without_pictures_says_so():
    class Bare(Pendulum):
        renderer = None

    with pytest.raises(ValueError, match="renderer"):
        SimulatorEnv(Bare(), SwingUp(), render_mode="rgb_array")


def test_a_slow_simulator_has_a_frame_rate():
    assert SimulatorEnv(Pendulum(dt=3.0), SwingUp()).metadata["render_fps"] == 1


def test_effects_with_memory_start_at_rest_and_can_be_set():
    from sims.effects import Delay

    env = SimulatorEnv(Pendulum(effects=[Delay("voltage", 0.05)]), SwingUp())
    _, info = env.reset(seed=0)
    assert len(info["state"]) == len(env.simulator.state_channels) > 2
    env.step(np.array([2.0]))
    later = env.step(np.array([0.0]))[4]["state"]
    env.reset(options={"state": later})
    np.testing.assert_array_equal(env._state, later)
