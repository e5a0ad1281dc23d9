"""A store that nobody measures: against an independent integrator."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sims.checks import check_simulator
from sims.effects import SecondStore, library
from sims.equations import FirstOrderSystem
from sims.pendulum_equation import PendulumEquation
from sims.simulator import Channel

ROOM = 20.0


class Oven(FirstOrderSystem):
    dt = 2.0
    state_channels = (Channel("air", "degC", "other", scale=50.0),)
    action_channels = (Channel("power", "W", "input", scale=500.0, low=0.0, high=1000.0),)

    def derivative(self, x, u, p):
        return (u - 5.0 * (x - ROOM)) / 800.0


def test_it_follows_the_state_and_holds_it_back():
    rate, time = 0.01, 100.0
    oven = Oven(effects=[SecondStore("air", rate, time)])
    assert oven.state_channels[-1].name == "air store"
    path = oven.rollout(oven.augment([[ROOM]])[0], np.full((50, 1), 500.0))

    def rates(_, x):
        return [(500.0 - 5.0 * (x[0] - ROOM)) / 800.0 + rate * (x[1] - x[0]), (x[0] - x[1]) / time]

    truth = solve_ivp(rates, (0, 100), [ROOM, ROOM], t_eval=2.0 * np.arange(51), rtol=1e-10)
    assert path == pytest.approx(truth.y.T, abs=1e-5)


def test_rows_have_stores_of_their_own_and_none_changes_no_bit():
    plain, rng = Oven(), np.random.default_rng(0)
    states, actions = rng.normal(50, 5, (4, 2)), rng.uniform(0, 1000, (4, 1))
    rate, time = np.array([0.0, 0.01, 0.02, 0.5]), np.array([5.0, 100.0, 20.0, 7.0])
    together = plain.with_effects([SecondStore("air", rate, time)]).step(states, actions)
    for i in range(1, 4):
        alone = plain.with_effects([SecondStore("air", float(rate[i]), float(time[i]))])
        assert np.array_equal(alone.step(states[[i]], actions[[i]])[0], together[i])
    assert np.array_equal(together[:1, :1], plain.step(states[:1, :1], actions[:1]))
    assert "failed" not in repr(
        check_simulator(plain.with_effects([SecondStore("air", 0.01, 50.0)]))
    )


def test_it_is_offered_at_states_that_do_not_move():
    assert "second_store@air" in {str(effect) for effect in library(Oven())}
    assert not any(effect.name == "second_store" for effect in library(PendulumEquation()))
    with pytest.raises(ValueError, match="'pivot' moves"):
        PendulumEquation(effects=[SecondStore("pivot")])
