"""The corrected simulator is a simulator, and right where the difference is known."""

import numpy as np
import pytest

from residual import CorrectedSimulator, DifferenceModel, Linear, accuracy_along
from residual.accuracy import uniform_rollouts
from residual.trajectories import Transitions
from sims.checks import check_simulator
from sims.pendulum import Pendulum


def sampled(system, n, seed=0):
    rng = np.random.default_rng(seed)
    states = rng.uniform([-np.pi, -12], [np.pi, 12], (n, 2))
    actions = rng.uniform(-3, 3, (n, 1))
    return Transitions(states, actions, system.step(states, actions), np.zeros(n, dtype=int))


@pytest.fixture(scope="module")
def corrected():
    model = DifferenceModel(Linear(), Pendulum()).fit(sampled(Pendulum.true(), 1500))
    return CorrectedSimulator(Pendulum(), model)


def test_it_keeps_the_simulator_contract(corrected):
    assert not [str(finding) for finding in check_simulator(corrected) if not finding.ok]


def test_it_predicts_the_true_system_better_than_the_idealised_one(corrected):
    fresh = sampled(Pendulum.true(), 500, seed=1)
    error = corrected.step(fresh.states, fresh.actions) - fresh.next_states
    gap = Pendulum().step(fresh.states, fresh.actions) - fresh.next_states
    assert np.all(np.std(error, axis=0) < 0.05 * np.std(gap, axis=0))


def test_a_difference_for_another_control_period_is_refused(corrected):
    with pytest.raises(ValueError, match=r"0\.02"):
        CorrectedSimulator(Pendulum(dt=0.02), corrected.difference)


def test_rates_stay_finite_under_a_wrong_difference():
    class Absurd(Linear):
        def predict(self, X, return_std=False):
            return np.full((len(X), 2), 1e6)

    model = DifferenceModel(Absurd(), Pendulum()).fit(sampled(Pendulum.true(), 50))
    reached = CorrectedSimulator(Pendulum(), model).step([[0.0, 0.0]], [[0.0]])
    assert reached[0, 1] == 80.0


@pytest.mark.parametrize("wrong", [1e6, -1e200, np.inf, np.nan])
def test_a_wrong_difference_never_leaves_the_numbers(wrong):
    class Absurd(Linear):
        def predict(self, X, return_std=False):
            return np.full((len(X), 2), wrong)

    model = DifferenceModel(Absurd(), Pendulum()).fit(sampled(Pendulum.true(), 50))
    simulator = CorrectedSimulator(Pendulum(), model)
    states = simulator.rollout(np.zeros((3, 2)), np.ones((3, 400, 1)))
    assert np.isfinite(states).all()
    # Positions, too, do not run faster than eight of their scales a step.
    assert np.abs(np.diff(states[:, :, 0], axis=1)).max() <= 8.0
    assert simulator.held == 3 * 400


def test_a_good_difference_is_never_held(corrected):
    before = corrected.held
    corrected.step(*uniform_rows(100))
    assert corrected.held == before


def uniform_rows(n):
    rows = sampled(Pendulum(), n, seed=7)
    return rows.states, rows.actions


class TestAccuracy:
    def test_no_error_for_a_model_that_is_the_truth(self, corrected):
        """Data made by the corrected simulator itself leave it without any error."""
        states, actions = uniform_rollouts(corrected, np.random.default_rng(2), 30)
        measured = accuracy_along(corrected, states, actions)
        assert max(measured.one_step.values()) < 1e-12
        assert max(measured.multi_step["1 s"].values()) < 1e-9

    def test_one_where_the_model_predicts_nothing(self):
        data = sampled(Pendulum(), 200)  # no gap, so the model learns zero
        model = CorrectedSimulator(Pendulum(), DifferenceModel(Linear(), Pendulum()).fit(data))
        states, actions = uniform_rollouts(Pendulum.true(), np.random.default_rng(3), 40)
        measured = accuracy_along(model, states, actions)
        np.testing.assert_allclose(list(measured.one_step.values()), 1, rtol=1e-6)
        np.testing.assert_allclose(list(measured.multi_step["0.25 s"].values()), 1, rtol=1e-6)

    def test_multi_step_error_is_that_of_an_open_loop_rollout(self, corrected):
        states, actions = uniform_rollouts(
            Pendulum.true(), np.random.default_rng(4), rollouts=3, steps=20
        )
        measured = accuracy_along(corrected, states, actions, horizons=(1.0,))
        pairs = zip(states, actions, strict=True)
        reached = np.stack([corrected.rollout(s[0], a)[-1] for s, a in pairs])
        expected = np.sqrt(np.mean((reached - states[:, -1]) ** 2, axis=0))
        np.testing.assert_allclose(
            list(measured.multi_step_error["1 s"].values()), expected, rtol=1e-12
        )

    def test_horizons_beyond_the_rollouts_are_left_out(self, corrected):
        states, actions = uniform_rollouts(Pendulum.true(), np.random.default_rng(5), 3, steps=6)
        assert list(accuracy_along(corrected, states, actions).multi_step) == ["0.25 s"]
