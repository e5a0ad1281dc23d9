import gymnasium
import numpy as np
import pytest
import torch

from policy import DDPG, DDPGConfig, OrnsteinUhlenbeck, collect, evaluate, learn_and_select, rollout
from policy.selection import score
from tests.policy.tiny import Reach

SMALL = DDPGConfig(hidden=(32, 24), batch=16, warm_up=50, actor_lr=1e-3, tau=1e-2)


class Push:
    """Pushes to the origin, proportionally."""

    def act(self, observation):
        return np.clip(-2 * observation[:1], -2, 1).astype(np.float32)


@pytest.mark.parametrize("noise", [None, OrnsteinUhlenbeck(1, rng=0)])
def test_rollout_records_what_happened(noise):
    run = rollout(Push(), Reach(length=12), seed=3, noise=noise)
    assert run.observations.shape == (13, 2) and run.actions.shape == (12, 1)
    np.testing.assert_allclose(run.states, run.observations, atol=1e-6)
    x, v = run.states.T
    np.testing.assert_allclose(v[1:], 0.5 * v[:-1] + 0.2 * run.actions[:, 0], atol=1e-6)
    np.testing.assert_allclose(run.rewards, -np.abs(x[1:]))
    assert run.total == pytest.approx(-np.abs(x[1:]).sum())
    assert not run.terminated
    planned = np.clip(-2 * run.observations[:-1, :1], -2, 1)
    assert np.allclose(planned, run.actions, atol=1e-6) == (noise is None)


def test_noise_is_in_units_of_the_normalised_action():
    """Bounds (-2, 1) have a half-width of 1.5."""

    class Still:
        def act(self, observation):
            return np.array([-0.5], np.float32)

    run = rollout(Still(), Reach(), 0, OrnsteinUhlenbeck(1, 0.05, 0.15, rng=7))
    noise = OrnsteinUhlenbeck(1, 0.05, 0.15, rng=7)
    expected = [-0.5 + 1.5 * noise()[0] for _ in range(20)]
    np.testing.assert_allclose(run.actions[:, 0], expected, atol=1e-6)


def test_environment_without_state_and_with_an_end():
    env = gymnasium.wrappers.TransformObservation(
        Reach(terminal=True), lambda o: o, Reach().observation_space
    )
    assert rollout(Push(), env, 0).terminated
    run = rollout(Push(), gymnasium.make("Pendulum-v1"), 0, max_steps=5)
    assert run.states is None and len(run.rewards) == 5


def test_evaluate_repeats_under_a_seed():
    first, second = (evaluate(Push(), Reach(), 4, seed=9) for _ in range(2))
    np.testing.assert_array_equal(first, second)
    assert len(set(first)) == 4


def test_collect_takes_exactly_the_samples_asked_for():
    runs = collect(Push(), Reach(length=20), 50, seed=0, noise=OrnsteinUhlenbeck(1, rng=1))
    assert [len(run.rewards) for run in runs] == [20, 20, 10]
    starts = {float(run.states[0, 0]) for run in runs}
    assert len(starts) == 3


def test_selection_keeps_the_best_and_can_go_back():
    agent = DDPG.for_env(Reach(), SMALL, seed=1)
    seen = []
    selection = learn_and_select(agent, Reach(), Reach(), 1000, every=250, callback=seen.append)
    assert tuple(seen) == selection.curve
    assert [point.step for point in seen] == [0, 250, 500, 750, 1000]
    assert selection.best == max(seen, key=lambda point: point.score)
    rule = (3, 0.03, SMALL.noise_theta, 0)
    assert score(agent.policy, Reach(), *rule)[0] == seen[-1].score
    agent.restore(selection.networks)
    assert score(agent.policy, Reach(), *rule)[0] == selection.best.score


def test_the_final_decides_among_the_best():
    agent = DDPG.for_env(Reach(), SMALL, seed=1)
    rule = dict(every=100, noisy=0, seed=5)
    copies = {}

    def keep(point):
        copies[point.step] = agent.policy.copy()

    found = learn_and_select(
        agent, Reach(), Reach(), 1000, **rule, callback=keep, finalists=3, final_episodes=4
    )
    best = sorted(found.curve, key=lambda point: -point.score)[:3]
    # The tests of this rule start from seed 5, the final from the seeds after it.
    means = [evaluate(copies[point.step], Reach(), 4, 6).mean() for point in best]
    assert len(set(means)) == 3
    assert found.final == max(means)
    assert found.best == best[int(np.argmax(means))]
    alone = learn_and_select(
        DDPG.for_env(Reach(), SMALL, seed=1), Reach(), Reach(), 1000, **rule, finalists=3
    )
    assert alone.final is None and alone.best == best[0]


def test_score_averages_one_quiet_and_some_noisy_rollouts():
    noise = OrnsteinUhlenbeck(1, 0.3, 0.2, np.random.default_rng(4))
    quiet, noisy = evaluate(Push(), Reach(), 1, 4), evaluate(Push(), Reach(), 2, 5, noise)
    mean, deterministic = score(Push(), Reach(), 2, 0.3, 0.2, seed=4)
    assert deterministic == quiet[0]
    assert mean == pytest.approx((quiet[0] + noisy.sum()) / 3)
    assert score(Push(), Reach(), 0, 0.3, 0.2, seed=4) == (quiet[0], quiet[0])


def test_scoring_does_not_disturb_learning():
    agents = [DDPG.for_env(Reach(), SMALL, seed=1) for _ in range(2)]
    agents[0].learn(Reach(), 300)
    learn_and_select(agents[1], Reach(), Reach(), 300, every=50)
    for name, tensor in agents[0].networks().items():
        torch.testing.assert_close(tensor, agents[1].networks()[name], rtol=0, atol=0)


def test_the_start_is_scored_and_unchanged_policies_are_not_scored_again():
    agent = DDPG.for_env(Reach(), SMALL)
    selection = learn_and_select(agent, Reach(), Reach(), 40, every=10)
    assert [point.step for point in selection.curve] == [0]  # still warming up
    env = Reach()
    with pytest.raises(ValueError, match="one object"):
        learn_and_select(agent, env, env, 40)
    stopped = learn_and_select(agent, Reach(), Reach(), 500, 20, callback=lambda p: p.step >= 20)
    assert stopped.curve[-1].step == 20
