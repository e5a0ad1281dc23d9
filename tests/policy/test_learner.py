"""Algorithms by name, policies of other libraries, and files that hold no code."""

import tempfile

import numpy as np
import pytest

from policy import DDPG, Algorithm, DDPGConfig, action_of, learn_and_select, load_policy, rollout
from policy.learner import imported
from policy.replay import Seen
from tests.policy.tiny import Reach

pytest.importorskip("stable_baselines3")
SMALL = {"policy_kwargs": {"net_arch": [16, 16]}, "learning_starts": 50, "batch_size": 16}
ALGORITHMS = [Algorithm(f"stable_baselines3.{name}", options=SMALL) for name in ("SAC", "TD3")]


def same(one, other):
    assert one.keys() == other.keys()
    for name, array in one.items():
        np.testing.assert_array_equal(array, other[name])


@pytest.mark.parametrize("algorithm", [
    pytest.param(ALGORITHMS[0], marks=pytest.mark.long, id="SAC"),
    pytest.param(ALGORITHMS[1], id="TD3"),
])  # fmt: skip
def test_another_librarys_algorithm_learns_is_kept_and_repeats(algorithm, tmp_path):
    learners = [algorithm.make(Reach(), 2**40 + 3) for _ in range(2)]
    for learner in learners:
        found = learn_and_select(learner, Reach(), Reach(), 200, every=50, noisy=1)
        assert found.curve[0].step == 0 and found.curve[-1].step == 200
        learner.restore(found.networks)
    same(learners[0].networks(), learners[1].networks())
    assert learners[0].updates >= 140
    learners[0].save(tmp_path / "agent.safetensors")
    loaded = algorithm.load(tmp_path / "agent.safetensors", Reach())
    same(loaded.networks(), learners[0].networks())
    rows = np.random.default_rng(0).normal(size=(5, 2))
    np.testing.assert_array_equal(loaded.act(rows), learners[0].act(rows))
    assert rollout(loaded.policy, Reach(), 3).total == rollout(learners[0].policy, Reach(), 3).total


def test_what_is_remembered_is_learnt_from_at_once():
    learner = ALGORITHMS[0].make(Reach(), 0)
    rng = np.random.default_rng(1)
    rows = rng.normal(size=(60, 2)), rng.uniform(-2, 1, (60, 1)), rng.normal(size=60)
    learner.remember(Seen(*rows, rng.normal(size=(60, 2)), np.zeros(60, bool)))
    assert learner.model.replay_buffer.size() == 60
    kept = learner.model.replay_buffer.actions[:60, 0]
    np.testing.assert_allclose(kept, 2 * (rows[1] + 2) / 3 - 1, atol=1e-6)
    learner.learn(Reach(), 10)
    assert learner.updates >= 9


def test_nothing_is_left_in_the_temporary_folder(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    ALGORITHMS[1].make(Reach(), 0).learn(Reach(), 60)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("options", "spread"), [
    ({}, 0.1), pytest.param({"action_noise": 0.03}, 0.03, marks=pytest.mark.long),
])  # fmt: skip
def test_a_policy_without_noise_of_its_own_explores(options, spread):
    still = SMALL | {"learning_rate": 0.0, "learning_starts": 0}
    learner = Algorithm("stable_baselines3.TD3", options=still | options).make(Reach(), 0)
    learner.learn(Reach(), 400)
    memory = learner.model.replay_buffer
    meant = learner.model.policy.scale_action(learner.act(memory.observations[:400, 0]))
    strayed = memory.actions[:400, 0] - meant
    assert 0.85 * spread < strayed.std() < 1.15 * spread


def test_ours_and_theirs_remember_the_same_actions():
    agent = DDPG.for_env(Reach(), DDPGConfig(hidden=(8, 8), batch=8))
    rng = np.random.default_rng(1)
    actions = rng.uniform(-2, 1, (5, 1))
    zeros = np.zeros((5, 2))
    agent.remember(Seen(zeros, actions, np.ones(5), zeros, np.zeros(5, bool)))
    np.testing.assert_allclose(agent.replay.stored()[:, 2:3], 2 * (actions + 2) / 3 - 1, atol=1e-6)
    np.testing.assert_allclose(agent.replay.stored()[:, 3], agent.config.reward_scale)


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("stable_baselines3.PPO", "no off-policy algorithm"),
        ("stable_baselines3.Nothing", "no learner 'stable_baselines3.Nothing'"),
        ("SAC", r"no import path: write stable_baselines3\.SAC"),
    ],
)
def test_a_wrong_algorithm_is_named(path, message):
    with pytest.raises(ValueError, match=message):
        Algorithm(path)


def test_an_algorithm_for_discrete_actions_is_refused_in_its_own_words():
    with pytest.raises(ValueError, match=r"learner DQN does not fit: .*Discrete"):
        Algorithm("stable_baselines3.DQN").make(Reach(), 0)


def test_a_file_in_place_of_what_is_in_it_is_told():
    with pytest.raises(ValueError, match=r"'my_file.py' is a file: .*my_file\.NAME"):
        imported("my_file.py", "system")


def test_options_of_another_algorithm_are_not_ddpgs():
    with pytest.raises(ValueError, match=r"options of policy\.DDPG"):
        Algorithm(options={"gamma": 0.9})


def test_an_option_that_an_algorithm_does_not_have_is_named():
    with pytest.raises(ValueError, match=r"has no option learning_rat, it has .*learning_rate"):
        Algorithm("stable_baselines3.SAC", options={"learning_rat": 0.1})
    assert Algorithm("stable_baselines3.SAC", options={"learning_rate": 0.1}).options


class Predicts:
    def predict(self, observation, deterministic=False):
        assert deterministic
        return np.array([0.25], np.float32), None


class Regresses:
    def predict(self, X):
        return np.array([0.5])


def test_policies_with_predict_act():
    assert action_of(Predicts(), np.zeros(2)) == 0.25
    assert action_of(Regresses(), np.zeros(2)) == 0.5
    assert (rollout(Predicts(), Reach(), 0).actions == 0.25).all()
    with pytest.raises(TypeError, match="is no policy"):
        action_of(object(), np.zeros(2))


def test_a_policy_is_loaded_from_either_file_or_by_name(tmp_path):
    agent = DDPG.for_env(Reach(), DDPGConfig(hidden=(8, 8), batch=8), seed=1)
    agent.save(tmp_path / "agent.safetensors")
    agent.policy.save(tmp_path / "policy.safetensors")
    rows = np.random.default_rng(0).normal(size=(4, 2))
    for name in ("agent", "policy"):
        loaded = load_policy(tmp_path / f"{name}.safetensors")
        np.testing.assert_array_equal(loaded.act(rows), agent.act(rows))
    assert isinstance(load_policy("tests.policy.test_learner.Predicts"), object)
    with pytest.raises(ValueError, match="no policy"):
        load_policy("tests.policy.nothing.Here")
    with pytest.raises(FileNotFoundError):
        load_policy(tmp_path / "absent.safetensors")


def test_the_same_agent_gives_the_same_bytes(tmp_path):
    agent = DDPG.for_env(Reach(), DDPGConfig(hidden=(8, 8), batch=8), seed=1)
    for name in ("a", "b"):
        agent.save(tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_a_policy_of_a_file_that_is_not_there():
    with pytest.raises(FileNotFoundError, match=r"there is no file nosuch: give a policy"):
        load_policy("nosuch")
