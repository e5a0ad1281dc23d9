"""The corrected simulator is a simulator, and right where the difference is known."""

import numpy as np
import pytest

from residual import CorrectedSimulator, DifferenceModel, Linear, accuracy_along, load, save
from residual.accuracy import uniform_rollouts, usual_steps
from residual.trajectories import Transitions
from sims.checks import check_simulator
from sims.effects import ActuatorLag
from sims.equations import FirstOrderSystem
from sims.pendulum import Pendulum
from sims.simulator import Channel


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


def test_what_was_seen_is_never_held_whatever_the_scale(tmp_path):
    """Scales are optional, and degrees per second move by hundreds."""

    class Degrees(FirstOrderSystem):
        dt = 0.01
        state_channels = (
            Channel("angle", "deg", "position"),
            Channel("speed", "deg/s", "rate", rate_of="angle"),
        )
        action_channels = (Channel("volts", "V", "input", low=-12.0, high=12.0),)

        def derivative(self, x, u, p):
            return np.stack([x[:, 1], 900 * u[:, 0] - 9 * x[:, 1]], axis=1)

    rng = np.random.default_rng(0)
    states, actions = rng.uniform(-800, 800, (50, 2)), rng.uniform(-12, 12, (50, 1))
    reached = Degrees().step(states, actions) + np.array([0.1, 5.0])
    data = Transitions(states, actions, reached, np.zeros(50, int))
    fitted = DifferenceModel(Linear(), Degrees()).fit(data)
    save(fitted, tmp_path / "difference.safetensors")
    for model in (fitted, load(tmp_path / "difference.safetensors", Degrees())):
        corrected = CorrectedSimulator(Degrees(), model)
        np.testing.assert_allclose(corrected.step(states, actions), reached, rtol=1e-3)
        assert corrected.held == 0


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

    def test_horizons_are_so_many_seconds_and_at_least_so_many_periods(self):
        assert usual_steps(0.05) == (5, 20)  # a quarter of a second and one
        assert usual_steps(0.002) == (125, 500)
        assert usual_steps(0.1) == usual_steps(2.0) == (5, 20)

    def test_a_slow_system_is_forecast_and_horizons_are_named_by_what_they_last(self):
        slow = Pendulum(dt=0.6)
        data = sampled(slow.with_parameters(mass=0.07), 300)
        model = CorrectedSimulator(slow, DifferenceModel(Linear(), slow).fit(data))
        rollouts = uniform_rollouts(slow, np.random.default_rng(6), 3, steps=6)
        assert list(accuracy_along(model, *rollouts).multi_step) == ["3 s"]
        asked = accuracy_along(model, *rollouts, horizons=(0.25, 1.0))
        assert list(asked.multi_step) == ["0.6 s", "1.2 s"]

    def test_rollouts_may_differ_in_length(self, corrected):
        """One that ends early takes nothing from the others."""
        states, actions = uniform_rollouts(Pendulum.true(), np.random.default_rng(7), 3, steps=30)
        whole = accuracy_along(corrected, states, actions)
        short = accuracy_along(corrected, [*states, states[0, :4]], [*actions, actions[0, :3]])
        assert short.multi_step_error == whole.multi_step_error
        assert list(short.multi_step) == ["0.25 s", "1 s"]

    def test_the_gap_is_told_as_a_share_of_what_a_step_changes(self, corrected):
        states, actions = uniform_rollouts(Pendulum.true(), np.random.default_rng(8), 20)
        assert min(accuracy_along(corrected, states, actions).gap.values()) > 0.01
        states, actions = uniform_rollouts(Pendulum(), np.random.default_rng(8), 20)
        assert set(accuracy_along(corrected, states, actions).gap.values()) == {0.0}

    def test_rollouts_from_anywhere_begin_at_rest_and_show_no_memory(self):
        lagging = Pendulum(effects=[ActuatorLag("voltage", 0.1)])
        states, actions = uniform_rollouts(lagging, np.random.default_rng(9), 4, steps=6)
        assert states.shape == (4, 7, 2)
        again = lagging.rollout(lagging.augment(states[:, 0]), actions)
        np.testing.assert_array_equal(states, again[:, :, :2])

    def test_horizons_beyond_the_rollouts_are_left_out(self, corrected):
        states, actions = uniform_rollouts(Pendulum.true(), np.random.default_rng(5), 3, steps=6)
        assert list(accuracy_along(corrected, states, actions).multi_step) == ["0.25 s"]


def test_accuracy_is_of_a_corrected_simulator():
    with pytest.raises(ValueError, match=r"CorrectedSimulator\(simulator, .*, got Pendulum"):
        accuracy_along(Pendulum(), np.zeros((1, 9, 2)), np.zeros((1, 8, 1)))
