"""The loop itself: the control arm, tests from several starts, and what is reported of them."""

import numpy as np
import pytest

from policy.config import DDPGConfig
from policy.ddpg import DDPG
from residual import Linear
from sims.pendulum_equation import PendulumEquation
from sims.tasks import SwingUp
from studies.learning.budget import Budget
from studies.learning.loop import learn_by_difference
from studies.learning.problem import PolicyTests, Problem
from studies.learning.simulated import FILE
from studies.learning.stages import Stages
from studies.running.progress import Silent

CORRECTED = {
    "class_path": "sims.pendulum_equation.PendulumEquation",
    "init_args": {"mass": 0.089974, "dt": 0.05},
}


@pytest.fixture(scope="module", params=["first", "all"])
def learnt(tmp_path_factory, request):
    problem = Problem(
        description={"system": "short pendulum"},
        idealised=PendulumEquation(),
        true=PendulumEquation.true(),
        task=SwingUp(horizon=30, start_at="anywhere"),
        tests=PolicyTests(
            every=60, every_true=60, episodes=3, true_episodes=3, noisy=1, visited_seconds=1.0
        ),
        measures=lambda run: {"turned": float(np.ptp(run.states[:, 0]))},
    )
    budget = Budget(
        true_samples=40,
        iterations=2,
        idealised_steps=120,
        difference_steps=60,
        true_steps=120,
        baseline_steps=60,
        control_steps=60,
        corrected_steps=60,
    )
    ddpg = DDPGConfig(hidden=(8, 8), warm_up=50, batch=8)
    stages = Stages(tmp_path_factory.mktemp("stages"))
    found = learn_by_difference(
        problem, Linear(), budget, ddpg, 0, stages, Silent(), 0.0, request.param, CORRECTED
    )
    return request.param, found


@pytest.fixture
def outcome(learnt):
    return learnt[1]


def test_what_was_simulated_is_kept_once_and_learnt_from_again(learnt):
    rule, outcome = learnt
    sizes = {
        name: len(DDPG.load(folder / "agent.safetensors").replay)
        for name, folder in outcome.folders.items()
    }
    kept = {name for name, folder in outcome.folders.items() if (folder / FILE).exists()}
    if rule == "all":
        assert set(sizes.values()) == {0}
        assert kept == {
            n for n in sizes if n.startswith(("idealised", "difference", "control", "corrected"))
        }
    else:
        assert not kept
        # The second update learns from the first one's 60 transitions again, and so the control.
        assert sizes["difference-1"] == sizes["control-1"] == 60
        assert sizes["difference-2"] == sizes["control-2"] == 120


def test_the_control_gets_the_same_training_and_no_true_samples(outcome):
    records = {(p["name"], p["iteration"]): p for p in outcome.policies}
    for iteration in (1, 2):
        difference, control = records["difference", iteration], records["control", iteration]
        assert control["simulated_steps"] == difference["simulated_steps"] == 60
        assert control["true_samples"] == 0
        assert difference["true_samples"] == 40 * iteration
        assert f"control-{iteration}" in outcome.folders


def test_a_policy_is_learnt_on_a_simulator_corrected_by_name(learnt):
    rule, outcome = learnt
    (named,) = (p for p in outcome.policies if p["name"] == "corrected")
    assert named["true_samples"] == 0 and named["simulated_steps"] == 60
    if rule == "all":
        simulated = np.load(outcome.folders["corrected"] / FILE)
        steps = PendulumEquation(0.089974).step(simulated["states"], simulated["actions"])
        np.testing.assert_allclose(simulated["next_states"], steps, atol=1e-4)


def test_policies_are_tested_from_several_starts_with_the_measures_asked_for(outcome):
    for policy in outcome.policies:
        if policy["name"] in ("idealised", "difference", "control", "corrected", "true"):
            returns = [test["return"] for test in policy["tests"]]
            assert len(set(returns)) == 3
            assert policy["return_true"] == pytest.approx(np.mean(returns))
            assert all(test["turned"] > 0 for test in policy["tests"])


def test_the_reference_read_at_a_smaller_budget_is_the_cold_start(outcome):
    cold = next(p for p in outcome.policies if p["name"] == "cold")
    assert cold["true_samples"] == 60 and max(step for step, _ in cold["curve"]) <= 60
