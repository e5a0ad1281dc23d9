"""A true system whose columns are in another order or unit is refused, and no other."""

import re

import numpy as np
import pytest

from sims.pendulum_equation import PendulumEquation
from sims.rates import refuse_unrelated_rates
from sims.unsound import Unsound


@pytest.fixture(scope="module")
def rollouts():
    """The true pendulum, pushed at random."""
    rng, true = np.random.default_rng(0), PendulumEquation.true()
    found = []
    for _ in range(3):
        actions = rng.uniform(-3, 3, (60, 1))
        found.append((true.rollout(np.array([np.pi, 0.0]), actions), actions))
    return found


def test_a_heavier_pendulum_is_no_other_order(rollouts):
    refuse_unrelated_rates("it", PendulumEquation(), rollouts)


def test_noise_at_rest_is_no_other_order():
    still = np.array([np.pi, 0.0]) + np.random.default_rng(1).normal(0, [1e-3, 0.2], (61, 2))
    refuse_unrelated_rates("it", PendulumEquation(), [(still, np.zeros((60, 1)))])


@pytest.mark.parametrize(
    "change",
    [
        pytest.param(lambda s: s[:, ::-1], id="order"),
        pytest.param(lambda s: s * [1.0, 180 / np.pi], id="degrees"),
        pytest.param(lambda s: s[::3], id="period"),
        pytest.param(lambda s: s * [1.0, -1.0], id="sign"),
    ],
)
def test_other_columns_units_and_periods_are_one_line(rollouts, change):
    wrong = [(change(states), actions[: len(change(states)) - 1]) for states, actions in rollouts]
    with pytest.raises(Unsound, match=r"'angle' does not move as 'rate' says, \d+% .* angle, rate"):
        refuse_unrelated_rates("it", PendulumEquation(), wrong)


@pytest.mark.parametrize("times", [0.5, 0.55, 2.0])
def test_a_period_that_is_another_one_is_told(rollouts, times):
    """Rates as they are, and positions that move in another period than the simulator's."""
    wrong = []
    for states, actions in rollouts:
        moved = states.copy()
        moved[:, 0] = states[0, 0] + times * (states[:, 0] - states[0, 0])
        wrong.append((moved, actions))
    with pytest.raises(
        Unsound, match=r"moves (\S+) times as far, as in periods of (\S+) s"
    ) as told:
        refuse_unrelated_rates("it", PendulumEquation(), wrong)
    found = re.search(r"moves (\S+) times .* periods of (\S+) s", str(told.value))
    assert [float(x) for x in found.groups()] == pytest.approx([times, 0.05 * times], rel=0.06)


def test_a_rate_sensor_that_is_a_fifth_off_is_a_gap_to_be_learnt(rollouts):
    off = [(states * [1.0, 1.2], actions) for states, actions in rollouts]
    refuse_unrelated_rates("it", PendulumEquation(), off)


def test_one_step_or_none_is_too_few_to_say():
    refuse_unrelated_rates("it", PendulumEquation(), [(np.zeros((1, 2)), np.zeros((0, 1)))])
