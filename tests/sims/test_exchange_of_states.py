"""What flows between two states: against its closed form."""

import numpy as np
import pytest

from sims.chosen import chosen_effects
from sims.effects import Exchange, library
from sims.equations import FirstOrderSystem
from sims.pendulum_equation import PendulumEquation
from sims.simulator import Channel

PAIR = "left and right"


class Bodies(FirstOrderSystem):
    """Three states in two units, and a speed; nothing moves them."""

    dt = 0.5
    state_channels = (
        Channel("left", "K", "other", scale=10.0),
        Channel("right", "K", "other", scale=10.0),
        Channel("level", "m", "other"),
        Channel("fan", "rad/s", "rate"),
    )
    action_channels = (Channel("heater", "W", "input"),)

    def derivative(self, x, u, p):
        return 0.0 * x


def test_the_difference_decays_and_the_heat_stays():
    into_left, into_right = 0.2, 0.05
    path = Bodies(effects=[Exchange(PAIR, into_left, into_right)]).rollout(
        [80.0, 20.0, 1.0, 3.0], np.zeros((20, 1))
    )
    left, right = path[:, 0], path[:, 1]
    fading = np.exp(-(into_left + into_right) * 0.5 * np.arange(21))
    assert left - right == pytest.approx(60.0 * fading, rel=1e-5)
    assert into_right * left + into_left * right == pytest.approx(0.05 * 80 + 0.2 * 20)
    assert (path[:, 2] == 1.0).all() and (path[:, 3] == 3.0).all()


def test_rows_have_rates_of_their_own_and_none_changes_no_bit():
    plain, rng = Bodies(), np.random.default_rng(0)
    states, actions = rng.normal(20, 5, (4, 4)), np.zeros((4, 1))
    first, second = np.array([0.0, 0.1, 0.0, 1.0]), np.array([0.0, 0.0, 0.3, 0.5])
    together = plain.with_effects([Exchange(PAIR, first, second)]).step(states, actions)
    for i in range(4):
        alone = plain.with_effects([Exchange(PAIR, float(first[i]), float(second[i]))])
        assert np.array_equal(alone.step(states[[i]], actions[[i]])[0], together[i])
    assert np.array_equal(together[0], plain.step(states, actions)[0])


def test_it_is_offered_between_states_of_one_unit():
    offered = [str(effect) for effect in library(Bodies()) if effect.name == "exchange"]
    assert offered == [f"exchange@{PAIR}"]
    (asked,) = chosen_effects(Bodies(), [f"exchange@{PAIR}"])
    assert asked == Exchange(PAIR)
    assert {q.unit for q in asked.quantities(Bodies()).values()} == {"1/s"}
    for names in ("left and level", "left and fan", "left", "right and left"):
        with pytest.raises(ValueError, match=f"it has: {PAIR}"):
            Bodies(effects=[Exchange(names)])
    with pytest.raises(ValueError, match="it has: none"):
        PendulumEquation(effects=[Exchange(PAIR)])
