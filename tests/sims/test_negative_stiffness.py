"""What pushes away from its balance: against SciPy, in every engine."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sims.effects import LinearSpring, NegativeStiffness, library
from sims.effects.library import further_in
from sims.equations import EquationOfMotion
from sims.pendulum import Pendulum
from sims.pendulum_equation import PendulumEquation
from sims.simulator import Channel

MASS, AWAY, BALANCE = 0.4, 12.0, 0.03


class Ball(EquationOfMotion):
    """A ball that is pushed."""

    dt = 0.01
    state_channels = (
        Channel("place", "m", "position", scale=0.05),
        Channel("rate", "m/s", "rate", rate_of="place", scale=0.4),
    )
    action_channels = (Channel("push", "N", "input", scale=1.0),)

    def acceleration(self, q, v, u, force, p):
        return (u + force) / MASS


def test_it_pushes_away_from_where_it_is_balanced():
    pushes = np.repeat([0.3, -0.5, 0.1], 20)
    effects = [NegativeStiffness("place", AWAY, BALANCE)]
    path = Ball(effects=effects, substeps=4).rollout(np.zeros(2), pushes[:, None])
    x = np.zeros(2)
    for k, u in enumerate(pushes):
        x = solve_ivp(
            lambda _, x, u=u: [x[1], (u + AWAY * (x[0] - BALANCE)) / MASS],
            (0, 0.01), x, rtol=1e-9, atol=1e-12,
        ).y[:, -1]  # fmt: skip
        assert path[k + 1] == pytest.approx(x, rel=1e-5, abs=1e-6)


@pytest.mark.parametrize("pendulum", [PendulumEquation(), Pendulum()], ids=["equation", "pymunk"])
def test_it_is_a_spring_of_the_other_sign(pendulum):
    def end(*effects):
        return pendulum.with_effects(effects).rollout([0.5, 1.0], np.zeros((8, 1)))[-1]

    away, back = NegativeStiffness("pivot", 0.2, 0.1), LinearSpring("pivot", 0.2, 0.1)
    assert end(away, back) == pytest.approx(end(), abs=1e-6)
    assert end(away)[0] > end()[0] > end(back)[0]


def test_it_is_a_rarer_effect_of_what_moves():
    assert "negative_stiffness@place" in map(str, further_in(Ball()))
    assert "negative_stiffness@place" not in map(str, library(Ball()))
