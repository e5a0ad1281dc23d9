import dataclasses
import math

import gymnasium
import jsonargparse
import numpy as np
import pytest
import torch

from policy import DDPG, DDPGConfig, MlpPolicy, evaluate
from tests.policy.tiny import Reach

SMALL = DDPGConfig(hidden=(32, 24), batch=16, warm_up=50, actor_lr=1e-3, tau=1e-2)


def state(agent):
    return agent.networks() | {"replay": agent.replay.stored()}


def assert_same(first, second):
    first, second = state(first), state(second)
    assert first.keys() == second.keys()
    for name in first:
        np.testing.assert_array_equal(first[name], second[name])


@pytest.mark.parametrize(("changes", "good"), [({}, -6), ({"action_layer": 2}, -12)])
def test_learns_to_reach_a_target(changes, good):
    agent = DDPG.for_env(Reach(), dataclasses.replace(SMALL, reward_scale=1.0, **changes), seed=1)
    untrained = evaluate(agent.policy.copy(), Reach(), 20, seed=100).mean()
    agent.learn(Reach(), 3000)
    trained = evaluate(agent.policy, Reach(), 20, seed=100).mean()
    # Doing nothing returns -10: the start is 0.5 away on average, for 20 steps.
    assert untrained < -20
    assert trained > good


@pytest.mark.parametrize("penalty", [None, 0.0])
def test_an_actor_at_a_bound_everywhere_comes_back(penalty):
    config = dataclasses.replace(SMALL, reward_scale=1.0)
    if penalty is not None:
        config = dataclasses.replace(config, saturation_penalty=penalty)
    agent = DDPG.for_env(Reach(), config, seed=1)
    agent._networks.actor.weights.bias3[:] = 12.0
    agent.learn(Reach(), 3000)
    learnt = evaluate(agent.policy, Reach(), 20, seed=100).mean()
    assert (learnt > -10) == (penalty != 0)


def test_one_update_is_algorithm_1_of_the_paper():
    """The targets, losses and moving averages, with autograd and torch's Adam as the oracle."""
    config = dataclasses.replace(
        SMALL, warm_up=10**6, tau=0.1, critic_weight_decay=1e-2, saturation_penalty=0.0
    )
    agent = DDPG.for_env(Reach(5, terminal=True), config, seed=3)
    agent.learn(Reach(5, terminal=True), 60)
    generator = np.random.default_rng(0)
    four = agent._networks
    for one in (four.actor, four.actor_target, four.critic, four.critic_target):
        one.parameters[:] = generator.normal(size=one.parameters.shape) * 0.2
    before = {name: torch.from_numpy(value) for name, value in agent.networks().items()}
    twin = np.random.default_rng()
    twin.bit_generator.state = agent._rng.bit_generator.state
    s, a, r, alive, following = map(torch.from_numpy, agent.replay.sample(16, twin))
    assert set(alive.flatten().tolist()) == {0.0, 1.0}
    first, second = config.hidden

    def mlp(flat, parts, outputs):
        """Two rectified layers and a linear one; the first is stored transposed, part by part."""
        shapes = [(parts[0].shape[1], first), (first,), *((p.shape[1], first) for p in parts[1:])]
        shapes += [(second, first), (second,), (outputs, second), (outputs,)]
        cut = flat.split([math.prod(shape) for shape in shapes])
        w1, b1, *others = (part.view(shape) for part, shape in zip(cut, shapes, strict=True))
        *more, w2, b2, w3, b3 = others
        hidden = parts[0] @ w1 + b1 + sum(p @ w for p, w in zip(parts[1:], more, strict=True))
        return torch.relu(torch.relu(hidden) @ w2.T + b2) @ w3.T + b3

    def actor(flat, x):
        return torch.tanh(mlp(flat, [x], 1))

    def critic(flat, x, u):
        return mlp(flat, [x, u], 1)

    goal = r + config.gamma * alive * critic(
        before["critic1.target"], following, actor(before["actor.target"], following)
    )
    expected_actor = before["actor"].clone().requires_grad_()
    expected_critic = before["critic1"].clone().requires_grad_()
    (-critic(before["critic1"], s, actor(expected_actor, s)).mean()).backward()
    torch.nn.functional.mse_loss(critic(expected_critic, s, a), goal).backward()
    torch.optim.Adam([expected_actor], config.actor_lr).step()
    torch.optim.Adam(
        [expected_critic], config.critic_lr, weight_decay=config.critic_weight_decay
    ).step()

    agent.update()
    after = {name: torch.from_numpy(value) for name, value in agent.networks().items()}
    tolerance = {"rtol": 1e-4, "atol": 2e-5}
    torch.testing.assert_close(after["actor"], expected_actor.detach(), **tolerance)
    torch.testing.assert_close(after["critic1"], expected_critic.detach(), **tolerance)
    for name in ("actor", "critic1"):
        moved = 0.9 * before[f"{name}.target"] + 0.1 * after[name]
        torch.testing.assert_close(after[f"{name}.target"], moved, rtol=1e-5, atol=1e-6)


def test_everything_follows_from_the_seed():
    agents = [DDPG.for_env(Reach(), SMALL, seed) for seed in (5, 5, 6)]
    for k, agent in enumerate(agents):
        np.random.seed(k)  # noqa: NPY002  the global generators must not matter
        torch.manual_seed(k)
        agent.learn(Reach(), 200)
    assert_same(agents[0], agents[1])
    assert not np.array_equal(state(agents[0])["actor"], state(agents[2])["actor"])


@pytest.mark.parametrize("capacity", [80, 1000])
def test_resumed_learning_equals_undisturbed_learning(tmp_path, capacity):
    config = dataclasses.replace(SMALL, replay=capacity)
    agent = DDPG.for_env(Reach(actions=2), config, seed=2)
    agent.learn(Reach(actions=2), 151)
    agent.save(tmp_path / "agent.safetensors")
    loaded = DDPG.load(tmp_path / "agent.safetensors")
    assert loaded.config == config
    assert_same(agent, loaded)
    for one in (agent, loaded):
        one.learn(Reach(actions=2), 100)
    assert_same(agent, loaded)
    assert [file.name for file in tmp_path.iterdir()] == ["agent.safetensors"]


def test_saved_without_replay_warms_up_again(tmp_path):
    agent = DDPG.for_env(Reach(), SMALL)
    agent.learn(Reach(), 100)
    agent.save(tmp_path / "agent.safetensors", replay=False)
    loaded = DDPG.load(tmp_path / "agent.safetensors")
    weights = loaded.networks()["actor"]
    loaded.learn(Reach(), SMALL.warm_up - 1)
    np.testing.assert_array_equal(loaded.networks()["actor"], weights)
    loaded.learn(Reach(), 1)
    assert not np.array_equal(loaded.networks()["actor"], weights)


def test_learning_continues_in_another_environment():
    agent = DDPG.for_env(Reach(), SMALL)
    agent.learn(Reach(), 60)
    assert (len(agent.replay), agent.updates) == (60, 11)
    agent.learn(Reach(length=10), 30)  # the replay is warm: every step updates
    assert (len(agent.replay), agent.updates) == (90, 41)


def test_a_time_out_is_not_terminal():
    for terminal in (False, True):
        agent = DDPG.for_env(Reach(5, terminal), SMALL)
        agent.learn(Reach(5, terminal), 40)
        alive = agent.replay.sample(500, np.random.default_rng(0)).alive
        assert (alive.min() == 0) == terminal


def test_callback_sees_progress_and_can_stop():
    agent, seen = DDPG.for_env(Reach(), SMALL), []
    agent.learn(Reach(), 45, seen.append, every=20)
    assert [(p.step, p.steps, len(p.returns)) for p in seen] == [
        (20, 45, 1),
        (40, 45, 2),
        (45, 45, 2),
    ]
    agent.learn(Reach(), 1000, lambda progress: progress.step == 40, every=20)
    assert len(agent.replay) == 45 + 40


def test_actions_are_within_bounds_and_one_row_equals_the_batch():
    env = Reach(actions=3)
    agent = DDPG.for_env(env, SMALL)
    rows = np.random.default_rng(0).normal(size=(50, 2)) * 1e4
    batch = agent.act(rows)
    assert batch.shape == (50, 3) and all(env.action_space.contains(a) for a in batch)
    np.testing.assert_allclose([agent.act(row) for row in rows], batch, rtol=1e-4, atol=1e-5)
    noisy = [agent.act(rows[0], noise=True) for _ in range(20)]
    assert all(env.action_space.contains(a) for a in noisy) and np.std(noisy) > 0
    with pytest.raises(ValueError, match="one observation at a time"):
        agent.act(rows, noise=True)
    with pytest.raises(ValueError, match=r"shape \(5,\), expected \(2,\)"):
        agent.act(np.zeros(5))


def test_policy_file_round_trip(tmp_path):
    agent = DDPG.for_env(Reach(), SMALL)
    agent.learn(Reach(), 80)
    agent.policy.save(tmp_path / "deep" / "policy.safetensors")
    loaded = MlpPolicy.load(tmp_path / "deep" / "policy.safetensors")
    rows = np.random.default_rng(0).normal(size=(30, 2))
    expected = agent.act(rows)
    np.testing.assert_array_equal(loaded.act(rows), expected)
    agent.learn(Reach(), 50)
    np.testing.assert_array_equal(loaded.act(rows), expected)
    assert not np.array_equal(agent.act(rows), expected)


def test_wrong_files_are_named(tmp_path):
    agent = DDPG.for_env(Reach(), SMALL)
    agent.policy.save(tmp_path / "policy")
    agent.save(tmp_path / "agent")
    (tmp_path / "text").write_text("hello")
    with pytest.raises(ValueError, match=r"MlpPolicy\.load"):
        DDPG.load(tmp_path / "policy")
    with pytest.raises(ValueError, match=r"expected 'simgap\.policy"):
        MlpPolicy.load(tmp_path / "agent")
    for load in (DDPG.load, MlpPolicy.load):
        with pytest.raises(ValueError, match="no safetensors file"):
            load(tmp_path / "text")
        with pytest.raises(FileNotFoundError):
            load(tmp_path / "absent")


def test_wrong_spaces_and_networks_are_named():
    box = gymnasium.spaces.Box(-1, 1, (2,))
    with pytest.raises(ValueError, match="finite bounds"):
        DDPG(box, gymnasium.spaces.Box(-np.inf, np.inf, (1,)))
    with pytest.raises(ValueError, match="action_space is Discrete"):
        DDPG(box, gymnasium.spaces.Discrete(3))
    agent = DDPG(box, box, SMALL)
    with pytest.raises(ValueError, match=r"action space is .* made for 2 action"):
        agent.learn(Reach(), 10)
    with pytest.raises(ValueError, match="spaces and the config"):
        agent.restore(DDPG.for_env(Reach(), SMALL).networks())


def test_a_diverging_environment_is_reported():
    class Diverging(Reach):
        def step(self, action):
            observation, reward, *rest = super().step(action)
            return observation, np.nan if self.k == 7 else reward, *rest

    with pytest.raises(FloatingPointError, match="step 7"):
        DDPG.for_env(Diverging(), SMALL).learn(Diverging(), 50)


@pytest.mark.parametrize(
    ("field", "value"), [("tau", 2.0), ("gamma", -0.1), ("batch", 0), ("replay", 5)]
)
def test_impossible_settings_are_named(field, value):
    with pytest.raises(ValueError, match=f"{field} is {value}"):
        DDPGConfig(**{field: value})
    with pytest.raises(ValueError, match="two layers"):
        DDPGConfig(hidden=(3,))  # type: ignore[arg-type]
    for hidden in ((-3, 8), (0, 8), (2.5, 8)):
        with pytest.raises(ValueError, match=r"ddpg.hidden is \(.*expected whole numbers from 1"):
            DDPGConfig(hidden=hidden)  # type: ignore[arg-type]


def test_config_is_a_command_line_group():
    parser = jsonargparse.ArgumentParser(exit_on_error=False)
    parser.add_class_arguments(DDPGConfig, "ddpg")
    read = parser.parse_args(["--ddpg.hidden=[64, 32]", "--ddpg.noise_sigma=0.2"])
    config = parser.instantiate(read).ddpg
    assert config == DDPGConfig(hidden=(64, 32), noise_sigma=0.2)
    with pytest.raises(jsonargparse.ArgumentError):
        parser.parse_args(["--ddpg.batch=many"])
