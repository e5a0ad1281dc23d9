"""DifferenceModel: targets, features, units, and any regressor."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.ensemble import GradientBoostingRegressor, RandomForestRegressor
from sklearn.exceptions import NotFittedError
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.linear_model import BayesianRidge, LinearRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import PolynomialFeatures

from residual.difference import DifferenceModel
from residual.dropout_net import DropoutNet
from residual.features import ChannelFeatures
from residual.gaussian_process import GaussianProcess
from residual.linear import Linear
from residual.trajectories import Transitions
from sims.simulator import Channel, Simulator


class Swing(Simulator):
    """Explicit Euler pendulum: its difference to another is exactly known."""

    name = "swing"
    dt = 0.05
    state_channels = (
        Channel("angle", "rad", "position", angle=True),
        Channel("rate", "rad/s", "rate", rate_of="angle", scale=10.0),
    )
    action_channels = (Channel("voltage", "V", "input", low=-3.0, high=3.0),)

    def __init__(self, pull=0.0, shift=0.0):
        self.pull, self.shift, self.parameters = pull, shift, {}

    def step(self, states, actions):
        states, actions = self.check_rows(states, actions)
        angle, rate = states.T
        faster = rate + self.dt * (self.pull * np.sin(angle) + actions[:, 0])
        return np.stack([angle + self.dt * rate + self.shift, faster], axis=1)


def observed(system, n=200, seed=0):
    random = np.random.default_rng(seed)
    states = random.uniform([-20, -10], [20, 10], (n, 2))
    actions = random.uniform(-3, 3, (n, 1))
    return Transitions(states, actions, system.step(states, actions), np.zeros(n, int))


def truth(system, states):
    return np.stack(
        [np.full(len(states), system.shift), 0.05 * system.pull * np.sin(states[:, 0])], 1
    )


@pytest.mark.parametrize(
    ("estimator", "tolerance", "has_std"),
    [
        (Linear(), 1e-4, True),
        (GaussianProcess(random_state=0), 1e-3, True),
        (DropoutNet(hidden=(60, 60), dropout=0.0, epochs=200, learning_rate=0.01,
                    random_state=0),
         0.2, True),
        (LinearRegression(), 1e-9, False),
        (RandomForestRegressor(20, random_state=0), 0.3, False),
        (GradientBoostingRegressor(n_estimators=30, random_state=0), 0.4, False),
        (BayesianRidge(), 1e-3, True),
        (GaussianProcessRegressor(optimizer=None, alpha=1e-6), 0.05, True),
        (make_pipeline(PolynomialFeatures(2), LinearRegression()), 1e-9, False),
    ],
    ids=lambda value: type(value).__name__,
)  # fmt: skip
def test_any_regressor_learns_the_difference_in_si_units(estimator, tolerance, has_std):
    system = Swing(pull=80.0, shift=0.01)
    before = repr(estimator)
    model = DifferenceModel(estimator, Swing()).fit(observed(system))
    fresh = observed(system, seed=1)
    expected = truth(system, fresh.states)
    mean, std = model.predict(fresh.states, fresh.actions, return_std=True)
    assert mean.shape == (200, 2)
    error = np.sqrt(np.mean((mean - expected) ** 2, axis=0))
    assert error[1] < tolerance * expected[:, 1].std()
    assert error[0] < 0.01 * tolerance + 1e-9
    assert model.has_std is has_std and (std is not None) is has_std
    if has_std:
        assert std.shape == (200, 2) and np.all(std >= 0)
    assert np.array_equal(model.predict(fresh.states, fresh.actions), mean)
    assert repr(estimator) == before and not hasattr(estimator, "n_features_in_")


def test_the_target_is_the_wrapped_difference_of_next_states():
    seen = {}

    class Spy(RegressorMixin, BaseEstimator):
        def for_simulator(self, simulator):
            return self

        def fit(self, X, y):
            seen.update(X=X, y=y)
            return self

    states, actions = np.array([[3.1, 1.0], [-3.1, 0.0]]), np.array([[9.0], [0.0]])
    # The second row's next state was recorded two turns further.
    shift = np.array([[0.2, 1.0], [0.3 + 4 * np.pi, -1.0]])
    after = Swing().step(states, actions) + shift
    DifferenceModel(Spy(), Swing()).fit(Transitions(states, actions, after, np.zeros(2, int)))
    assert np.allclose(seen["y"], [[0.2, 1.0], [0.3, -1.0]])
    assert np.allclose(seen["X"], [[3.1, 1.0, 3.0], [-3.1, 0.0, 0.0]])  # 9 V is clipped to 3 V


def test_features_are_cosine_sine_and_scaled_columns():
    features = ChannelFeatures.for_simulator(Swing()).fit(np.zeros((1, 3)))
    expected = [[np.cos(2.0), np.sin(2.0), 0.5, -0.5]]
    assert np.allclose(features.transform(np.array([[2.0, 5.0, -1.5]])), expected)
    assert np.allclose(features.transform([[2.0 + 6 * np.pi, 5.0, -1.5]]), expected)
    with pytest.raises(ValueError, match="4 features"):
        features.transform(np.zeros((1, 4)))


def test_an_infinite_scale_hides_a_channel():
    class Blind(Swing):
        state_channels = (
            Swing.state_channels[0],
            dataclasses.replace(Swing.state_channels[1], scale=np.inf),
        )

    for estimator in (Linear(), GaussianProcess(random_state=0)):
        model = DifferenceModel(estimator, Blind()).fit(observed(Swing(pull=80.0)))
        here = model.predict([[1.0, 0.0]], [[0.0]])
        assert np.array_equal(here, model.predict([[1.0, 50.0]], [[0.0]]))


def test_rows_have_the_same_bits_alone_and_together():
    data = observed(Swing(pull=80.0))
    for estimator in (Linear(), GaussianProcess(random_state=0),
                      DropoutNet(hidden=(60,), epochs=3, random_state=0)):  # fmt: skip
        model = DifferenceModel(estimator, Swing()).fit(data)
        together = model.predict(data.states[:9], data.actions[:9])
        alone = [model.predict(data.states[k : k + 1], data.actions[k : k + 1]) for k in range(9)]
        assert np.array_equal(np.vstack(alone), together)


def test_whole_turns_and_actions_beyond_the_bounds_do_not_matter():
    data = observed(Swing(pull=80.0))
    for estimator in (Linear(), GaussianProcess(random_state=0)):
        model = DifferenceModel(estimator, Swing()).fit(data)
        here = model.predict([[1.0, 2.0]], [[3.0]])
        assert np.allclose(model.predict([[1.0 + 2 * np.pi, 2.0]], [[3.0]]), here, atol=1e-6)
        assert np.array_equal(model.predict([[1.0, 2.0]], [[30.0]]), here)


def test_mistakes_are_explained():
    model = DifferenceModel(Linear(), Swing())
    with pytest.raises(NotFittedError, match=r"call fit\(transitions\)"):
        model.predict([[0.0, 0.0]], [[0.0]])
    with pytest.raises(ValueError, match="needs at least 2"):
        model.fit(observed(Swing(), n=1))
    model.fit(observed(Swing(pull=1.0)))
    with pytest.raises(ValueError, match=r"states has shape \(2,\).*angle, rate"):
        model.predict([0.0, 0.0], [[0.0]])
    with pytest.raises(ValueError, match=r"actions has shape \(1, 2\).*voltage"):
        model.predict([[0.0, 0.0]], [[0.0, 1.0]])


def test_it_refuses_another_control_period_and_other_channels():
    model = DifferenceModel(Linear(), Swing())
    model.check_fits(Swing(pull=3.0))
    slower, renamed = Swing(), Swing()
    slower.dt = 0.1
    with pytest.raises(ValueError, match=r"period of 0.05 s, the simulator has 0.1 s"):
        model.check_fits(slower)
    renamed.state_channels = (
        Channel("phi", "rad", "position", angle=True),
        Swing.state_channels[1],
    )
    with pytest.raises(ValueError, match="angle, rate, the simulator has phi, rate"):
        model.check_fits(renamed)
