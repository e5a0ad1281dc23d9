"""Other libraries train on our environments as they are."""

import gymnasium
import numpy as np
import pytest

import residual
from residual.trajectories import Transitions
from sims.pendulum import Pendulum


def test_stable_baselines3_trains_on_the_corrected_pendulum(tmp_path):
    stable_baselines3 = pytest.importorskip("stable_baselines3")
    rng = np.random.default_rng(0)
    states, actions = rng.uniform([-3, -10], [3, 10], (200, 2)), rng.uniform(-3, 3, (200, 1))
    data = Transitions(
        states, actions, Pendulum.true().step(states, actions), np.zeros(200, dtype=int)
    )
    path = tmp_path / "difference.safetensors"
    residual.save(residual.DifferenceModel(residual.Linear(), Pendulum()).fit(data), path)
    env = gymnasium.make("simgap/PendulumCorrected-v0", difference=path)
    agent = stable_baselines3.DDPG(
        "MlpPolicy", env, policy_kwargs={"net_arch": [32, 32]}, learning_starts=100, seed=0
    )
    before = agent.actor.mu[0].weight.detach().clone()
    agent.learn(450)
    assert agent.num_timesteps == 450
    assert (agent.actor.mu[0].weight != before).any()
    action, _ = agent.predict(env.reset(seed=0)[0])
    assert env.action_space.contains(action.astype(np.float64))
