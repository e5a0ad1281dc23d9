"""A constant loss against what flows: against equations in which that is written out."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sims.effects import ConstantLoss, library
from sims.effects.library import further_in
from sims.equations import FirstOrderSystem
from sims.simulator import Channel

R, L, K, J, LOST = 0.6, 2e-3, 0.08, 4e-4, 0.75


class Drive(FirstOrderSystem):
    """A motor by its voltage."""

    dt = 1e-3
    state_channels = (
        Channel("current", "A", "other", scale=5.0),
        Channel("speed", "rad/s", "rate", scale=50.0),
    )
    action_channels = (Channel("voltage", "V", "input", scale=12.0),)

    def derivative(self, x, u, p):
        current, speed = x.T
        return np.stack([(u[:, 0] - R * current - K * speed) / L, K * current / J], axis=1)


def test_the_voltage_that_an_inverter_loses_goes_against_the_current():
    volts = np.repeat([[6.0], [-9.0], [3.0]], 60, axis=0)
    path = Drive(effects=[ConstantLoss("current", LOST / L)]).rollout(np.zeros(2), volts)

    def rates(_, x, u):
        return [(u - R * x[0] - K * x[1] - LOST * np.tanh(x[0] / 1e-4)) / L, K * x[0] / J]

    x = np.zeros(2)
    for k, u in enumerate(volts[:, 0]):
        x = solve_ivp(rates, (0, 1e-3), x, "LSODA", rtol=1e-9, atol=1e-9, args=(u,)).y[:, -1]
        assert path[k + 1] == pytest.approx(x, abs=0.02)


def test_what_is_less_than_the_loss_makes_nothing_flow():
    host = Drive(effects=[ConstantLoss("current", LOST / L)])
    assert np.array_equal(host.rollout(np.zeros(2), np.full((20, 1), 0.7)), np.zeros((21, 2)))
    assert host.rollout(np.zeros(2), np.full((20, 1), 0.8))[-1, 0] > 0


def test_it_is_a_rarer_effect_of_what_flows_and_coulomb_friction_of_what_moves():
    drive = Drive()
    assert "constant_loss@current" in map(str, further_in(drive))
    assert not [e for e in (*library(drive), *further_in(drive)) if str(e) == "constant_loss@speed"]
    with pytest.raises(ValueError, match="'speed' moves: there it is coulomb_friction"):
        drive.with_effects([ConstantLoss("speed", 1.0)])
