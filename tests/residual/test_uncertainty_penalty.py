"""Caution: less reward where the difference model is unsure, the same elsewhere."""

import numpy as np
import pytest
from sklearn.ensemble import ExtraTreesRegressor

from residual import GaussianProcess
from residual.difference import DifferenceModel
from residual.trajectories import Transitions
from residual.uncertainty_penalty import PenalisedTask
from sims.pendulum_equation import PendulumEquation
from sims.tasks import SwingUp


@pytest.fixture(scope="module")
def near_hanging():
    """Transitions of a heavier pendulum within 0.3 rad of hanging."""
    rng = np.random.default_rng(0)
    states = rng.uniform([np.pi - 0.3, -1], [np.pi + 0.3, 1], (60, 2))
    actions = rng.uniform(-3, 3, (60, 1))
    following = PendulumEquation.true().step(states, actions)
    return Transitions(states, actions, following, np.zeros(60, dtype=np.int64))


def test_pays_less_away_from_the_data(near_hanging):
    model = DifferenceModel(GaussianProcess(), PendulumEquation()).fit(near_hanging)
    cautious = PenalisedTask.around(SwingUp(), model, near_hanging, 2.0)
    known = near_hanging.states[:5], near_hanging.actions[:5]
    far = np.array([[0.0, 6.0]]), np.zeros((1, 1))

    def lost(states, actions):
        following = model.simulator.step(states, actions)
        plain = SwingUp().reward(states, actions, following)
        return plain - cautious.reward(states, actions, following)

    assert lost(*known).max() < 0.1 * lost(*far)[0]
    assert (lost(*known) >= 0).all()
    assert cautious.horizon == SwingUp().horizon


def test_needs_a_standard_deviation(near_hanging):
    model = DifferenceModel(ExtraTreesRegressor(2), PendulumEquation()).fit(near_hanging)
    with pytest.raises(ValueError, match="predicts no standard deviation"):
        PenalisedTask.around(SwingUp(), model, near_hanging, 1.0)
