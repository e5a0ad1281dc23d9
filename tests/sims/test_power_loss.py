"""A loss by a power of what is there: against SciPy."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sims.effects import PowerLoss, library
from sims.effects.library import further_in
from sims.equations import FirstOrderSystem
from sims.pendulum_equation import PendulumEquation
from sims.simulator import Channel


class Tank(FirstOrderSystem):
    """A tank that is filled, and has no outlet."""

    dt = 1.0
    state_channels = (Channel("level", "m", "other", scale=1.0),)
    action_channels = (Channel("inflow", "m/s", "input", scale=0.02),)

    def derivative(self, x, u, p):
        return u + 0.0 * x


@pytest.mark.parametrize("power", [0.5, 1.5, 2.0])
def test_a_hole_empties_a_tank_as_scipy_says(power):
    flows = np.repeat([0.02, 0.0, 0.01], 30)
    leak = PowerLoss("level", 0.01, power, 2.0)
    path = Tank(effects=[leak], substeps=4).rollout(np.array([1.0]), flows[:, None])
    x = np.array([1.0])
    for k, u in enumerate(flows):
        x = solve_ivp(
            lambda _, x, u=u: u - 0.01 * (x / 2.0) ** power, (0, 1.0), x, rtol=1e-9, atol=1e-11
        ).y[:, -1]
        assert path[k + 1] == pytest.approx(x, abs=1e-7)


def test_it_takes_from_either_sign_and_rests_at_zero():
    leak = Tank(effects=[PowerLoss("level", 0.01, 0.5, 1.0)], substeps=8)
    ends = leak.rollout(np.array([[0.5], [-0.5], [0.0]]), np.zeros((3, 400, 1)))[:, -1, 0]
    assert np.abs(ends) == pytest.approx(0.0, abs=1e-3)


def test_it_is_a_rarer_effect_of_what_is_stored_and_none_of_what_moves():
    assert "power_loss@level" in map(str, further_in(Tank()))
    assert "power_loss@level" not in map(str, library(Tank()))
    with pytest.raises(ValueError, match="moves: there it is quadratic_drag"):
        PendulumEquation(effects=[PowerLoss("pivot", 0.1)])
