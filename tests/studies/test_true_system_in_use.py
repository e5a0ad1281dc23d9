"""What the true system costs and says: tests apart from training, steps, warnings, samples."""

import dataclasses
import sys
from pathlib import Path

import numpy as np
import pytest
from sklearn.ensemble import ExtraTreesRegressor

from policy import DDPGConfig
from residual import Linear
from residual.estimator import check_regressor
from residual.gap import find_gap
from sims.pendulum_equation import PendulumEquation
from sims.protocol import EvaluationProtocol
from sims.system import System
from sims.tasks import SwingUp
from studies.learning.budget import Budget
from studies.learning.loop import learn_by_difference
from studies.learning.testing import test_on_truth as tried_on_truth
from studies.running.progress import Silent

sys.path.insert(0, str(Path(__file__).parents[1] / "sims"))
from foreign import Foreign

QUICK = {"estimator": Linear(), "samples": 60, "updates": 1, "steps": 60, "progress": Silent()}
QUICK |= {"ddpg": DDPGConfig(hidden=(8, 8), warm_up=50, batch=8)}


class Loose(Foreign):
    """A robot whose cable comes loose once, in a step that is counted over all episodes."""

    taken, loose_at = 0, 0

    def step(self, action):
        Loose.taken += 1
        if Loose.taken == Loose.loose_at:
            raise TimeoutError("no answer")
        return super().step(action)


@pytest.mark.long
def test_what_was_trained_is_kept_if_the_robot_fails_in_a_test(tmp_path, monkeypatch):
    monkeypatch.setattr(Loose, "taken", 0)
    monkeypatch.setattr(Loose, "loose_at", 10)
    with pytest.raises(ValueError, match="no answer"):
        with_loose(tmp_path)
    (trained,) = [path for path in tmp_path.iterdir() if path.name.startswith("idealised-")]
    when = trained.stat().st_mtime_ns
    learnt = with_loose(tmp_path)
    assert trained.stat().st_mtime_ns == when
    assert [policy["name"] for policy in learnt.policies] == ["idealised", "difference"]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """What is learnt of a robot that does not break off, its steps, and where it was kept."""
    folder = tmp_path_factory.mktemp("whole")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Loose, "taken", 0)
        patch.setattr(Loose, "loose_at", 0)
        return with_loose(folder), Loose.taken, folder


def with_loose(folder):
    return learn_by_difference(PendulumEquation(), Loose, SwingUp(horizon=30), keep=folder, **QUICK)


@pytest.mark.parametrize(
    "loose_at",
    [
        pytest.param(1 + 45, marks=pytest.mark.long),
        pytest.param(1 + 150 + 35, marks=pytest.mark.long),
        1 + 150 + 60 + 150 + 40,
    ],
)
def test_a_robot_that_breaks_off_costs_the_episode_at_hand(whole, tmp_path, monkeypatch, loose_at):
    whole, needed, kept = whole
    monkeypatch.setattr(Loose, "taken", 0)
    monkeypatch.setattr(Loose, "loose_at", loose_at)
    with pytest.raises(ValueError, match="no answer"):
        with_loose(tmp_path)
    broken = with_loose(tmp_path)
    # The check that it steps at all comes again, and so does the episode at hand.
    assert Loose.taken - needed <= 1 + 30
    measured = [
        {name: value for name, value in one.accuracy[0].items() if name != "fit_seconds"}
        for one in (broken, whole)
    ]
    assert measured[0] == measured[1]
    assert [p["tests"] for p in broken.policies] == [p["tests"] for p in whole.policies]
    assert all(
        np.array_equal(one.states, other.states)
        for one, other in zip(broken.runs, whole.runs, strict=True)
    )
    left = [
        sorted(path.name.rsplit("-", 1)[0] for path in folder.iterdir())
        for folder in (tmp_path, kept)
    ]
    assert left[0] == left[1] and "collect" in left[0] and "episode" not in left[0]


def test_every_step_of_the_true_system_is_counted(monkeypatch):
    monkeypatch.setattr(Loose, "taken", 0)
    monkeypatch.setattr(Loose, "loose_at", 0)
    learnt = learn_by_difference(PendulumEquation(), Loose, SwingUp(horizon=30), **QUICK)
    tested = sum(policy["tested_steps"] for policy in learnt.policies)
    # One more is the check that it steps at all.
    assert tested + learnt.accuracy[0]["rollout_steps"] + 60 + 1 == Loose.taken


@pytest.mark.long
def test_what_the_true_system_warns_of_stands_in_the_report(tmp_path):
    class Cut(Foreign):
        def step(self, action):
            *seen, _, info = super().step(action)
            return *seen, self.steps == 20, info

    learnt = learn_by_difference(PendulumEquation(), Cut, SwingUp(horizon=30), **QUICK)
    (warning,) = learnt.policies[0]["warnings"]
    assert warning.startswith("the true environment Cut ended an episode after 20 of 30 steps")
    page = learnt.report(tmp_path / "report.html").read_text().replace("\u00a0", " ")
    assert "The true environment Cut ended an episode after 20 of 30 steps" in page
    assert "tests and accuracy on the truth" in page


@pytest.mark.long
def test_the_true_samples_are_runs_that_find_gap_takes():
    options = QUICK | {"samples": 300}
    heavy = PendulumEquation().with_parameters(mass=0.08)
    learnt = learn_by_difference(
        PendulumEquation(), heavy, SwingUp(horizon=60, start_at="anywhere"), **options
    )
    assert sum(len(run.actions) for run in learnt.runs) == 300
    found = find_gap(PendulumEquation(), learnt.runs, effects=["mass", "viscous_friction"])
    (named,) = (v for v in found.verdicts if v.kind == "confirmed")
    assert named.effect == "mass"
    assert named.parameters["change"].value == pytest.approx(0.025, rel=1e-3)


def test_rows_that_the_true_simulator_cannot_step_are_left_out_anywhere(caplog):
    class Torn(PendulumEquation):
        def acceleration(self, q, v, u, force, p):
            found = super().acceleration(q, v, u, force, p)
            return np.where(np.abs(v) > 18.0, np.nan, found)

    learnt = learn_by_difference(PendulumEquation(), Torn.true(), SwingUp(horizon=30), **QUICK)
    (accuracy,) = learnt.accuracy
    assert all(np.isfinite(list(accuracy["uniform"]["one_step"].values())))
    assert "values that are not finite from" in caplog.text


def test_a_simulator_corrected_by_name_is_trained_on_as_long_as_the_others():
    assert Budget(450, 1, 6000, 4000).steps_on_corrected == 4000
    assert Budget(450, 1, 6000, 4000, corrected_steps=500).steps_on_corrected == 500


def test_a_setting_that_scikit_learn_refuses_is_refused_at_once():
    with pytest.raises(ValueError, match=r"ExtraTreesRegressor: The 'n_estimators' parameter"):
        check_regressor(ExtraTreesRegressor(n_estimators="abc"))


def test_tests_say_how_long_they_were():
    class Still:
        def act(self, observation):
            return np.zeros(1)

    system = System(
        "still", PendulumEquation(), PendulumEquation.true(), SwingUp(horizon=30),
        EvaluationProtocol(true_episodes=3),
    )  # fmt: skip
    summary, _ = tried_on_truth(dataclasses.replace(system), Still(), 0)
    assert summary["tested_steps"] == 90 and summary["warnings"] == []
