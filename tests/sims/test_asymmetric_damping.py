"""A damper that is harder one way than the other: against SciPy, in every engine."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sims.effects import AsymmetricDamping, library
from sims.effects.library import further_in
from sims.equations import EquationOfMotion
from sims.pendulum import Pendulum
from sims.pendulum_equation import PendulumEquation
from sims.simulator import Channel

MASS, DAMPER, SPRING, HARDER = 250.0, 1500.0, 18000.0, 850.0


class Seat(EquationOfMotion):
    """A seat on a spring and a damper."""

    dt = 0.01
    state_channels = (
        Channel("place", "m", "position", scale=0.05),
        Channel("rate", "m/s", "rate", rate_of="place", scale=0.4),
    )
    action_channels = (Channel("load", "N", "input", scale=600.0),)

    def acceleration(self, q, v, u, force, p):
        return (u + force - DAMPER * v - SPRING * q) / MASS


def test_a_shock_absorber_takes_more_one_way():
    loads = np.repeat([900.0, -900.0, 300.0], 60)
    effects = [AsymmetricDamping("place", HARDER)]
    path = Seat(effects=effects, substeps=4).rollout(np.zeros(2), loads[:, None])
    x = np.zeros(2)
    for k, u in enumerate(loads):
        x = solve_ivp(
            lambda _, x, u=u: [
                x[1],
                (u - (DAMPER + (HARDER if x[1] > 0 else -HARDER)) * x[1] - SPRING * x[0]) / MASS,
            ],
            (0, 0.01), x, rtol=1e-9, atol=1e-11,
        ).y[:, -1]  # fmt: skip
        assert path[k + 1] == pytest.approx(x, abs=2e-5)


@pytest.mark.parametrize("pendulum", [PendulumEquation(), Pendulum()], ids=["equation", "pymunk"])
def test_a_pendulum_that_only_swings_one_way_is_damped_so_far(pendulum):
    def end(effect, rate):
        start = pendulum.with_effects([effect]).augment([[0.5, rate]])
        return pendulum.with_effects([effect]).rollout(start[0], np.zeros((6, 1)))[-1]

    harder, none = AsymmetricDamping("pivot", 0.02), AsymmetricDamping("pivot", 0.0)
    assert end(harder, 6.0)[1] < end(none, 6.0)[1] - 1e-3
    assert end(harder, -6.0)[1] < end(none, -6.0)[1] - 1e-3


def test_it_is_a_rarer_effect_of_what_moves():
    assert "asymmetric_damping@place" in map(str, further_in(Seat()))
    assert "asymmetric_damping@place" not in map(str, library(Seat()))
