"""A learnt policy acts on states in the units of the system's channels, kept, loaded or not."""

import dataclasses

import gymnasium
import numpy as np
import pytest

import sims
from policy import DDPG, Algorithm, DDPGConfig, MlpPolicy, load_policy, rollout
from residual import Linear
from sims import Channel, EquationOfMotion, EvaluationProtocol, Parameter, System, Task
from sims.effects import ActuatorLag
from sims.environment import SimulatorEnv, observe
from studies.learning.loop import learn_by_difference
from studies.learning.training import state_columns
from studies.running.progress import Silent


class Lift(EquationOfMotion):
    """A mass that is lifted and turned: its units are far from what a policy sees."""

    dt = 0.1
    state_channels = (
        Channel("height", "mm", "position", scale=500.0),
        Channel("turn", "rad", "position", angle=True),
        Channel("speed", "mm/s", "rate", rate_of="height", scale=2000.0),
        Channel("turn rate", "rad/s", "rate", rate_of="turn", scale=4.0),
    )
    action_channels = (
        Channel("force", "N", "input", scale=50.0, low=-50.0, high=50.0),
        Channel("torque", "N m", "input", low=-1.0, high=1.0),
    )
    parameters = {"mass": Parameter(2.0, "kg", "lifted", low=0.1)}

    def acceleration(self, q, v, u, force, p):
        lift = 1000 * (u[:, 0] + force[:, 0]) / p.mass
        return np.stack([lift, u[:, 1] + force[:, 1] - np.sin(q[:, 1])], axis=1)


class Hold(Task):
    horizon = 15

    def start(self, rng):
        return np.array([800.0, 1.0, 300.0, 0.0]) * rng.uniform(0.5, 1.0, 4)

    def reward(self, states, actions, next_states):
        return -np.abs(next_states[:, 0]) / 500


TESTS = EvaluationProtocol(every=100, episodes=1, noisy=0, true_episodes=1)
SMALL = DDPGConfig((8, 8), warm_up=50, batch=16)
SAC = {"policy_kwargs": {"net_arch": [8, 8]}, "learning_starts": 50}


def lift_learnt(**more):
    return learn_by_difference(
        Lift(), Lift().with_parameters(mass=3.0), Hold(), estimator=Linear(), samples=40,
        updates=1, steps=100, evaluation=TESTS, progress=Silent(), **more,
    )  # fmt: skip


@pytest.fixture(scope="module")
def in_memory():
    return lift_learnt(ddpg=SMALL)


@pytest.mark.parametrize(
    "simulator",
    [
        Lift(),
        Lift(effects=[ActuatorLag("force", 0.2)]),
        sims.Pendulum(),
        sims.Leo(),  # Hides how far it has come.
    ],
)
def test_what_a_policy_sees_of_a_state_is_what_the_environment_observes(simulator):
    columns = state_columns(simulator)
    states = 3 * np.random.default_rng(0).normal(size=(9, len(simulator.state_channels)))
    np.testing.assert_array_equal(columns.observe(states), observe(simulator, states))
    np.testing.assert_array_equal(columns.observe(states[0]), observe(simulator, states[:1])[0])
    bare = states[:, : sum(c.kind != "memory" for c in simulator.state_channels)]
    np.testing.assert_array_equal(columns.observe(bare), observe(simulator, states))


@pytest.mark.parametrize(
    "learner",
    ["policy.DDPG", pytest.param("stable_baselines3.SAC", marks=pytest.mark.long)],
)
def test_a_loaded_policy_acts_on_states_as_it_did_in_its_rollout(tmp_path, learner, in_memory):
    ours = learner == "policy.DDPG"
    if not ours:
        pytest.importorskip("stable_baselines3")
    learnt = in_memory if ours else lift_learnt(learner=learner, learner_options=SAC)
    training = learnt.trainings["difference-1"]
    training.learner.save(tmp_path / "agent.safetensors")
    if ours:
        learnt.policy.save(tmp_path / "policy.safetensors")
        loaded = [load_policy(tmp_path / f"{name}.safetensors") for name in ("agent", "policy")]
    else:
        env = SimulatorEnv(Lift(), Hold())
        loaded = [Algorithm(learner, options=SAC).load(tmp_path / "agent.safetensors", env).policy]
    episode = training.episode
    for policy in (learnt.policy, *loaded):
        acted = [policy.act_on(state) for state in episode["states"][:-1]]
        np.testing.assert_array_equal(acted, episode["actions"])
        together = policy.act_on(episode["states"][:-1])
        np.testing.assert_allclose(together, episode["actions"], rtol=1e-4, atol=1e-4)
    # What it is not: states taken for observations.
    with pytest.raises(ValueError, match=r"observation has shape|[Ss]hape"):
        loaded[0].act(episode["states"][0])


@pytest.mark.long
def test_kept_steps_know_their_columns_and_have_the_same_bytes(tmp_path, in_memory):
    kept, again = (lift_learnt(ddpg=SMALL, keep=tmp_path / "kept") for _ in range(2))
    state = [700.0, 0.5, -200.0, 0.1]
    np.testing.assert_array_equal(kept.policy.act_on(state), again.policy.act_on(state))
    for name, learnt in (("a", kept), ("b", in_memory)):
        learnt.policy.save(tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


@pytest.fixture(scope="module")
def agent():
    env = SimulatorEnv(Lift(), Hold())
    return DDPG.for_env(env, SMALL, columns=state_columns(Lift()))


@pytest.mark.parametrize(
    ("state", "says"),
    [
        ([1.0, 2.0, 3.0], r"state has shape \(3,\), expected \(4,\).*height \(mm\), turn \(rad\)"),
        (np.zeros((1, 2, 4)), r"state has shape \(1, 2, 4\)"),
        ([1.0, 2.0, np.nan, 0.0], "state: speed is nan, expected finite numbers"),
        ([[0.0] * 4, [np.inf, 0.0, 0.0, 0.0]], "state: height is inf"),
        ([None] * 4, "height is nan"),
    ],
)
def test_a_state_that_is_none_is_refused(agent, state, says):
    with pytest.raises(ValueError, match=says):
        agent.policy.act_on(state)


@pytest.mark.parametrize("bad", [np.nan, -np.inf, None, "a"])
def test_an_observation_that_is_not_finite_is_refused(agent, bad):
    with pytest.raises(ValueError, match=r"observation (has|is) .*expected (finite|real) numbers"):
        agent.policy.act([0.0, bad, 0.0, 0.0, 0.0])


def test_own_files_without_columns_say_so_and_act(tmp_path, agent):
    env = SimulatorEnv(Lift(), Hold())
    own = DDPG.for_env(env, SMALL)
    own.save(tmp_path / "agent.safetensors")
    own.policy.save(tmp_path / "policy.safetensors")
    for name in ("agent", "policy"):
        loaded = load_policy(tmp_path / f"{name}.safetensors")
        assert rollout(loaded, env, 0).total < 0
        with pytest.raises(ValueError, match=r"does not know.*give act\(observation\)"):
            loaded.act_on([0.0] * 4)
    assert agent.policy.copy().columns == agent.policy.columns
    assert "acts on height (mm), turn (rad)" in repr(agent.policy)


def test_columns_that_do_not_fit_are_refused(agent):
    with pytest.raises(ValueError, match="make 3 observations, but the policy takes 5"):
        dataclasses.replace(agent.policy, columns=state_columns(sims.Pendulum()))
    with pytest.raises(ValueError, match="is no column of a state"):
        dataclasses.replace(agent.policy.columns.columns[0], scale=0.0)
    assert isinstance(agent.policy, MlpPolicy)


def test_a_state_of_the_true_system_is_read_the_same_way(agent):
    system = System("lift", Lift(), Lift(effects=[ActuatorLag("force", 0.2)]), Hold(), TESTS)
    env: gymnasium.Env = system.true_environment()
    observation, info = env.reset(seed=0)
    state = info["state"][: len(Lift.state_channels)]
    np.testing.assert_array_equal(agent.policy.act_on(state), agent.policy.act(observation))
