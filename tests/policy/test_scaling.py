"""What is learnt does not depend on the units of observations and rewards."""

import gymnasium
import numpy as np
import pytest

from policy import DDPG, Algorithm, DDPGConfig, load_policy
from policy.replay import Seen
from policy.scaling import Scaling
from tests.policy.tiny import Reach

SIZE, MIDDLE, REWARD = 1e-3, 300.0, 1e4
CONFIG = DDPGConfig((16, 16), warm_up=50)
IN_UNITS = Scaling(np.full(2, MIDDLE), np.full(2, SIZE), 1 / REWARD)


class InUnits(gymnasium.Wrapper):
    """The same task in other units."""

    def __init__(self):
        super().__init__(Reach())
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (2,))

    def reset(self, **options):
        observation, info = self.env.reset(**options)
        return MIDDLE + SIZE * observation.astype(float), info

    def step(self, action):
        observation, reward, *rest = self.env.step(action)
        return MIDDLE + SIZE * observation.astype(float), REWARD * reward, *rest


def rows(n=7):
    return np.random.default_rng(0).normal(size=(n, 2))


def test_units_make_no_difference(tmp_path):
    plain = DDPG.for_env(Reach(), CONFIG, 0)
    other = DDPG.for_env(InUnits(), CONFIG, 0, IN_UNITS)
    plain.learn(Reach(), 200)
    other.learn(InUnits(), 200)
    told = MIDDLE + SIZE * rows()
    np.testing.assert_allclose(other.act(told), plain.act(rows()), atol=1e-4)
    np.testing.assert_allclose(other.replay.stored(), plain.replay.stored(), atol=1e-4)
    other.save(tmp_path / "agent.safetensors", replay=False)
    other.policy.save(tmp_path / "policy.safetensors")
    for name in ("agent", "policy"):
        loaded = load_policy(tmp_path / f"{name}.safetensors")
        np.testing.assert_array_equal(loaded.act(told), other.act(told))


def test_another_librarys_algorithm_is_scaled_too(tmp_path):
    pytest.importorskip("stable_baselines3")
    small = {"policy_kwargs": {"net_arch": [16, 16]}, "learning_starts": 50, "batch_size": 16}
    algorithm = Algorithm("stable_baselines3.SAC", options=small)
    plain, other = algorithm.make(Reach(), 0), algorithm.make(InUnits(), 0, scaling=IN_UNITS)
    plain.learn(Reach(), 100)
    other.learn(InUnits(), 100)
    told = MIDDLE + SIZE * rows()
    others = Seen(told, rows()[:, :1], REWARD * rows()[:, 0], told, np.zeros(7, bool))
    other.remember(others)
    memory = other.model.replay_buffer
    np.testing.assert_allclose(memory.rewards[100:107, 0], rows()[:, 0], atol=1e-6)
    np.testing.assert_allclose(other.act(told), plain.act(rows()), atol=1e-3)
    other.save(tmp_path / "agent.safetensors")
    loaded = algorithm.load(tmp_path / "agent.safetensors", InUnits())
    np.testing.assert_array_equal(loaded.act(told), other.act(told))


class Columns(gymnasium.Env):
    """Kelvin, micrometres in m, a set point, cosine of an angle, a column of usual size, and one
    that is far from zero."""

    observation_space = gymnasium.spaces.Box(
        np.array([-np.inf, -np.inf, -np.inf, -1.0, -np.inf, -np.inf], np.float32),
        np.array([np.inf, np.inf, np.inf, 1.0, np.inf, np.inf], np.float32),
    )
    action_space = gymnasium.spaces.Box(-1.0, 1.0, (1,))

    def _seen(self):
        drawn = self.np_random.normal([350, 0, 1, 0, 4], [20, 1e-6, 0, 2, 1])
        return np.insert(drawn, 2, 7.0)

    def reset(self, **options):
        super().reset(**options)
        return self._seen(), {}

    def step(self, action):
        return self._seen(), 2e-4, False, False, {}


class Runaway(Columns):
    """Rewards that no square holds."""

    def step(self, action):
        return self._seen(), -1e200, False, False, {}


def test_what_runs_away_is_refused_with_what_it_reached():
    with pytest.raises(ValueError, match=r"a reward of 1e\+200: it runs away; mend its equation"):
        Scaling.measured(Runaway())


def test_only_what_networks_could_not_learn_from_is_scaled():
    scaling = Scaling.measured(Columns())
    assert scaling.middle[0] == pytest.approx(350, abs=5)
    assert scaling.spread[:2] == pytest.approx([20, 1e-6], rel=0.2)
    assert scaling.middle[2] == 7.0 and scaling.spread[2] == 1.0
    np.testing.assert_array_equal(scaling.middle[3:5], 0)
    assert scaling.middle[5] == pytest.approx(4, abs=0.1)
    np.testing.assert_array_equal(scaling.spread[3:], 1)
    assert scaling.reward == pytest.approx(5000, rel=1e-2)
