"""The loop itself: the control arm, tests from several starts, and what is reported of them."""

import itertools
from types import MappingProxyType

import numpy as np
import pytest
from sklearn.ensemble import ExtraTreesRegressor

from policy import Algorithm, DDPGConfig
from residual import Linear, NamedEffects
from sims import Channel, FirstOrderSystem, Parameter
from sims.effects import ActuatorLag
from sims.environment import SimulatorEnv
from sims.pendulum_equation import PendulumEquation
from sims.protocol import EvaluationProtocol
from sims.system import System
from sims.tasks import SwingUp, Task
from studies.learning import steps as steps_module
from studies.learning import streams, testing, training
from studies.learning.budget import Budget
from studies.learning.kept import OnDisk
from studies.learning.loop import learn_by_difference, run_loop
from studies.learning.outcome import Learnt
from studies.learning.steps import Steps
from studies.running.progress import Silent

BUDGET = Budget(
    true_samples=40,
    iterations=2,
    idealised_steps=120,
    difference_steps=60,
    true_steps=120,
    baseline_steps=60,
    control_steps=60,
    corrected_steps=60,
)
LINEAR = Linear()
DDPG = DDPGConfig(hidden=(8, 8), warm_up=50, batch=8)
SYSTEM = System(
    name="short pendulum",
    nominal=PendulumEquation(),
    true=PendulumEquation.true(),
    task=SwingUp(horizon=30, start_at="anywhere"),
    evaluation=EvaluationProtocol(
        every=60, every_true=60, episodes=3, true_episodes=3, noisy=1, visited_seconds=1.0
    ),
    measures=lambda states, actions: {"turned": float(np.ptp(states[:, 0]))},
)


def learnt_with(keeper, rule="first"):
    do = Steps(SYSTEM, Linear(), Algorithm(ddpg=DDPG), 0, keeper, Silent(), rule)
    return run_loop(do, BUDGET, PendulumEquation(0.089974))


@pytest.fixture(scope="module", params=["first", pytest.param("all", marks=pytest.mark.long)])
def learnt(tmp_path_factory, request):
    return request.param, learnt_with(OnDisk(tmp_path_factory.mktemp("kept")), request.param)


@pytest.fixture
def outcome(learnt):
    return learnt[1]


def test_what_is_to_be_learnt_again_is_kept(learnt):
    rule, outcome = learnt
    kept = {name: len(t.simulated) for name, t in outcome.trainings.items() if t.simulated}
    loop = {f"{kind}-{k}": 60 for kind in ("difference", "control") for k in (1, 2)}
    assert kept == (loop if rule == "first" else loop | {"idealised": 120, "corrected": 60})


def test_the_control_gets_the_same_training_and_no_true_samples(outcome):
    records = {(p["name"], p["iteration"]): p for p in outcome.policies}
    for iteration in (1, 2):
        difference, control = records["difference", iteration], records["control", iteration]
        assert control["simulated_steps"] == difference["simulated_steps"] == 60
        assert control["true_samples"] == 0
        assert difference["true_samples"] == 40 * iteration
        assert f"control-{iteration}" in outcome.trainings


def test_a_policy_is_learnt_on_a_simulator_corrected_by_name(learnt):
    rule, outcome = learnt
    (named,) = (p for p in outcome.policies if p["name"] == "corrected")
    assert named["true_samples"] == 0 and named["simulated_steps"] == 60
    if rule == "all":
        simulated = outcome.trainings["corrected"].simulated
        steps = PendulumEquation(0.089974).step(simulated.states, simulated.actions)
        np.testing.assert_allclose(simulated.next_states, steps, atol=1e-4)


def test_policies_are_tested_from_several_starts_with_the_measures_asked_for(outcome):
    for policy in outcome.policies:
        if policy["name"] in ("idealised", "difference", "control", "corrected", "true"):
            returns = [test["return"] for test in policy["tests"]]
            assert len(set(returns)) == 3
            assert policy["return_true"] == pytest.approx(np.mean(returns))
            assert all(test["turned"] > 0 for test in policy["tests"])


def test_all_policies_are_tested_from_the_same_starts(outcome):
    tested = [[t["start"] for t in p["tests"]] for p in outcome.policies if "tests" in p]
    assert len(tested) == 8 and all(starts == tested[0] for starts in tested)
    assert len({tuple(start) for start in tested[0]}) == 3
    starts = np.array([training.episode["states"][0] for training in outcome.trainings.values()])
    np.testing.assert_array_equal(starts, starts[:1].repeat(len(starts), axis=0))


@pytest.mark.parametrize(
    ("start_at", "count"), [pytest.param("anywhere", 5, marks=pytest.mark.long), ("hanging", 1)]
)
def test_there_are_several_starts_where_they_differ(start_at, count):
    task = SwingUp(horizon=20, start_at=start_at)
    found = quickly(PendulumEquation(), PendulumEquation.true(), task)
    for policy in found.policies:
        assert len(policy["tests"]) == count
        returns = [test["return"] for test in policy["tests"]]
        assert policy["return_true"] == pytest.approx(np.mean(returns))


def test_the_reference_read_at_a_smaller_budget_is_the_cold_start(outcome):
    cold = next(p for p in outcome.policies if p["name"] == "cold")
    assert cold["true_samples"] == 60 and max(step for step, _ in cold["curve"]) <= 60


def timeless(records):
    return [{k: v for k, v in record.items() if "seconds" not in k} for record in records]


@pytest.fixture(scope="module")
def watched(learnt):
    """The same loop in memory, and each random stream that it drew with what it was for."""
    drawn = []

    def watching(seed, *purpose):
        found = streams.stream(seed, *purpose)
        drawn.append((found, (seed, *purpose)))
        return found

    with pytest.MonkeyPatch.context() as patch:
        for module in (steps_module, training, testing):
            patch.setattr(module, "stream", watching)
        return learnt_with(None, learnt[0]), drawn


def test_in_memory_is_the_same_as_kept_on_disk(learnt, watched):
    outcome, memory = learnt[1], watched[0]
    assert timeless(memory.policies) == timeless(outcome.policies)
    assert timeless(memory.accuracy) == timeless(outcome.accuracy)
    for name, kept in outcome.trainings.items():
        ours, theirs = memory.trainings[name].learner.networks(), kept.learner.networks()
        for array in theirs:
            np.testing.assert_array_equal(ours[array], theirs[array])


def test_no_two_steps_share_a_random_stream(watched):
    drawn = watched[1]
    # Tests of policies that are to be compared begin alike; that stream is theirs alone.
    common = [pair for pair in drawn if pair[1] == (0, "test starts")]
    drawn = [pair for pair in drawn if pair not in common] + common[:1]
    purposes = {purpose for _, purpose in drawn}
    assert len(common) == len({p for p in purposes if p[1] == "train"}) == 8
    # Nothing else is drawn twice, and no two purposes begin within reach of each other.
    assert len(drawn) == len(purposes) >= 30
    begins = sorted(found for found, _ in drawn)
    assert all(b - a >= 2**20 for a, b in itertools.pairwise(begins))
    trainings = {p[2:] for p in purposes if p[1] == "train"}
    assert {("difference", 1), ("difference", 2), ("control", 1), ("cold", 0)} <= trainings


def quickly(nominal, true, task, estimator=LINEAR, **options):
    """The loop with next to no training."""
    return learn_by_difference(
        nominal, true, task, estimator=estimator, samples=40, updates=1, steps=60,
        ddpg=DDPG, progress=Silent(), **options,
    )  # fmt: skip


@pytest.mark.long
def test_a_true_system_with_hidden_memory_is_learnt_and_measured():
    class Named(SwingUp):
        def reward(self, states, actions, next_states):
            angle, rate = next_states.T
            return -np.abs(angle) - rate**2

    lagging = PendulumEquation(effects=[ActuatorLag("voltage", 0.1)])
    found = quickly(PendulumEquation(), lagging, Named(horizon=30), evaluation=SYSTEM.evaluation)
    (accuracy,) = found.accuracy
    for where in ("visited", "uniform"):
        assert set(accuracy[where]["one_step"]) == {"angle", "rate"}


def test_columns_in_another_order_are_refused_before_anything_is_learnt_from_them():
    def true():
        return SimulatorEnv(PendulumEquation.true(), SwingUp(horizon=30))

    def swapped(env, seen):
        return 10.0 * seen[2], np.arctan2(seen[1], seen[0])

    with pytest.raises(ValueError, match=r"true system: 'angle' does not move as 'rate' says"):
        quickly(PendulumEquation(), true, SwingUp(horizon=30), state_of=swapped)


def test_a_control_period_of_seconds_is_measured_over_enough_of_them():
    class Tank(FirstOrderSystem):
        dt = 2.0
        state_channels = (Channel("level", "m", "other"),)
        action_channels = (Channel("pump", "V", "input", low=0.0, high=1.0),)
        parameters = MappingProxyType({"hole": Parameter(0.05, "1/s", "outflow", low=0.0)})

        def derivative(self, x, u, p):
            return (0.1 * u[:, 0] - p.hole * x[:, 0])[:, None]

    class Level(Task):
        horizon = 25

        def start(self, rng):
            return rng.uniform(0, 1, 1)

        def reward(self, states, actions, next_states):
            return -np.abs(next_states[:, 0] - 0.5)

    (accuracy,) = quickly(Tank(), Tank().with_parameters(hole=0.07), Level()).accuracy
    assert list(accuracy["visited"]["multi_step"]) == ["10 s", "40 s"]


@pytest.fixture(scope="module")
def called():
    """One call from Python, with the estimator that names effects."""
    return learn_by_difference(
        SYSTEM.nominal, SYSTEM.true, SYSTEM.task, estimator=NamedEffects(), samples=40, updates=1,
        steps=120, ddpg=DDPG, evaluation=SYSTEM.evaluation, progress=Silent(), seed=3,
    )  # fmt: skip


def test_the_python_call_is_the_loop(called, tmp_path):
    assert [p["name"] for p in called.policies] == ["idealised", "difference"]
    assert called.policy.act(np.zeros(3)).shape == (1,)
    assert called.model.predict(np.zeros((1, 2)), np.zeros((1, 1))).shape == (1, 2)
    assert len(repr(called)) < 200 and "<table" in called._repr_html_()
    assert list(called.to_dataframe()["name"]) == ["idealised", "difference"]
    assert called.plot().axes
    page = called.report(tmp_path / "page.html")
    assert page == tmp_path / "page.html" and "closing the simulation gap" in page.read_text()


def test_what_named_effects_named_is_told(called, tmp_path):
    (record,) = called.accuracy
    assert record["says"] == called.model.fitted().says_ and "mass" in record["says"]
    page = called.report(tmp_path / "page.html").read_text()
    assert record["says"] in page.replace("\u00a0", " ")


@pytest.mark.long
def test_an_estimator_that_has_a_length_is_taken_as_well():
    """An ensemble of trees that is not fitted yet has no length, and asking for it raises."""
    trees = ExtraTreesRegressor(3, random_state=0)
    options = {"estimator": trees, "evaluation": SYSTEM.evaluation}
    found = quickly(SYSTEM.nominal, SYSTEM.true, SYSTEM.task, **options)
    assert type(found.model.estimator).__name__ == "ExtraTreesRegressor"


def test_settings_of_another_learner_are_not_taken_in_silence():
    with pytest.raises(ValueError, match=r"ddpg has settings of policy\.DDPG"):
        learn_by_difference(
            SYSTEM.nominal, SYSTEM.true, SYSTEM.task, learner="stable_baselines3.SAC", ddpg=DDPG
        )


@pytest.mark.parametrize(
    ("name", "given", "says"),
    [
        ("estimator", "residual.Linear", r"'residual.Linear', expected .*=residual.Linear"),
        ("estimator", Linear, r"estimator is the class Linear, expected an object"),
        ("evaluation", {}, r"evaluation is {}, expected .*EvaluationProtocol\("),
        ("ddpg", {"hidden": (8, 8)}, r"expected .*ddpg=DDPGConfig\("),
        ("budget", 450, r"budget is 450, expected .*Budget\("),
        ("seed", None, r"seed is None, expected a whole number from 0"),
        ("seed", -1, r"seed is -1"),
    ],
)
def test_an_argument_of_another_kind_is_one_line(name, given, says):
    arguments = {"estimator": Linear(), "ddpg": DDPG, "progress": Silent(), name: given}
    with pytest.raises(TypeError, match=says):
        learn_by_difference(SYSTEM.nominal, SYSTEM.true, SYSTEM.task, **arguments)


def test_without_an_update_there_is_no_model():
    with pytest.raises(ValueError, match="no update was made"):
        Learnt(SYSTEM.description()).model  # noqa: B018


def test_a_budget_that_teaches_nothing_is_refused():
    with pytest.raises(ValueError, match=r"budget.difference_steps is 40.*warm_up"):
        learn_by_difference(
            SYSTEM.nominal, SYSTEM.true, SYSTEM.task,
            budget=Budget(40, 1, 120, 40), ddpg=DDPG, progress=Silent(),
        )  # fmt: skip
