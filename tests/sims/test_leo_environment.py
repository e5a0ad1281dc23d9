"""Leo's environments behave as Gymnasium and its users expect."""

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from sims.environment import SimulatorEnv, observe
from sims.leo.simulator import STATE_CHANNELS, Leo
from sims.leo.walking import AUTHORS_OBSERVATION, Walking


@pytest.mark.parametrize("name", ["Idealised", "True"])
def test_registered_environments_pass_gymnasiums_checker(name):
    env = gymnasium.make(f"simgap/Leo{name}-v0", render_mode="rgb_array")
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", ".*normalized space.*")
        warnings.filterwarnings("ignore", ".*(infinity|-infinity).*")
        check_env(env.unwrapped)


def test_the_true_leo_is_heavier_and_rubs():
    true, ideal = (gymnasium.make(f"simgap/Leo{n}-v0").unwrapped for n in ("True", "Idealised"))
    values = true.simulator.parameter_values()
    assert values["torso_mass"] == 1.25 and values["friction"] == 0.03
    values = ideal.simulator.parameter_values()
    assert values["torso_mass"] == 0.94226 and values["friction"] == 0.0


def test_a_policy_sees_all_but_how_far_it_has_come_in_scaled_channels():
    env = SimulatorEnv(Leo(), Walking())
    state = np.arange(18.0)
    observation, _ = env.reset(options={"state": state})
    assert observation.shape == env.observation_space.shape == (17,)
    scales = np.array([channel.scale for channel in STATE_CHANNELS])
    np.testing.assert_allclose(observation, (state / scales)[1:])


def test_a_policy_can_see_what_the_authors_saw():
    env = gymnasium.make("simgap/LeoIdealised-v0", observed=AUTHORS_OBSERVATION).unwrapped
    state = np.arange(18.0)
    seen, _ = env.reset(options={"state": state})
    assert seen.shape == env.observation_space.shape == (14,)
    scales = np.array([channel.scale for channel in STATE_CHANNELS])
    np.testing.assert_allclose(seen, (state / scales)[[*range(2, 9), *range(11, 18)]])


def test_an_unknown_channel_to_observe_is_named():
    with pytest.raises(ValueError, match=r"tail.*left_hip"):
        observe(Leo(), np.zeros((1, 18)), ["tail"])


def test_stops_and_the_rule_for_knees_can_be_chosen():
    env = gymnasium.make("simgap/LeoTrue-v0", stops=True, knees="free", start_at="around")
    assert env.unwrapped.simulator.stops and env.unwrapped.task.knees == "free"


def test_an_episode_ends_with_a_fall():
    env = gymnasium.make("simgap/LeoIdealised-v0")
    env.reset(seed=0)
    terminated, rewards = False, []
    while not terminated:
        _, reward, terminated, truncated, _ = env.step(np.zeros(6))
        rewards.append(reward)
        assert not truncated and len(rewards) < 100
    assert rewards[-1] < -70 < min(rewards[:-1])


def test_the_camera_goes_along_and_sees_the_legs_move():
    env = gymnasium.make("simgap/LeoIdealised-v0", render_mode="rgb_array").unwrapped
    _, info = env.reset(seed=0)
    start = env.render()
    assert start.shape == (240, 240, 3) and start.dtype == np.uint8

    def picture(**changes):
        state = info["state"].copy()
        for column, value in changes.items():
            state[int(column[1:])] = value
        env.reset(options={"state": state})
        return env.render().astype(int)

    # One metre on, the marks on the ground look the same again.
    assert np.abs(picture(_0=1.0) - start).mean() < 1e-3
    assert np.abs(picture(_0=0.1) - start).mean() > 0.1
    assert np.abs(picture(_4=-0.4) - start).mean() > 1
