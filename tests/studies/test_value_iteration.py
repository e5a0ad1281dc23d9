"""The physical limit against closed-form and published figures."""

import numpy as np
import pytest

from sims.pendulum import Pendulum
from sims.pendulum_equation import PendulumEquation
from sims.tasks import SwingUp
from studies.systems.pendulum import BEST
from tests.studies.value_iteration import episode_return, value_iteration


@pytest.fixture(scope="module")
def coarse():
    return value_iteration(PendulumEquation(), SwingUp(), angles=121, rates=121, actions=9)


def test_upright_costs_nothing_and_hanging_most(coarse):
    upright = coarse.values[60, 60]
    assert upright == pytest.approx(0, abs=1e-6)
    assert coarse.values[0, 60] < -100


def test_the_value_is_symmetric(coarse):
    np.testing.assert_allclose(coarse.values, coarse.values[::-1, ::-1], atol=0.05)


def test_it_swings_the_pendulum_up_nearly_as_well_as_a_fine_grid(coarse):
    found = episode_return(coarse, PendulumEquation(), np.array([np.pi, 0.0]))
    # -317 on a 361 x 301 grid with 25 actions.
    assert -360 < found < -310


# The paper's variant runs on demand: the same grid solves the pendulum that studies take.
@pytest.mark.parametrize("follows", [pytest.param(True, marks=pytest.mark.long), False])
def test_the_best_return_that_reports_tell_is_that_of_a_fine_grid(follows):
    policy = value_iteration(PendulumEquation.true(inertia_follows_mass=follows), SwingUp())
    true = Pendulum.true(inertia_follows_mass=follows)
    found = episode_return(policy, true, np.array([np.pi, 0.0]))
    assert found == pytest.approx(BEST[follows], abs=1.0)
