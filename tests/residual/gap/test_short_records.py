"""Records too short for forecasts of the usual length: what their usual number hides."""

from typing import ClassVar

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter

OFFERED = ["gain", "time_constant", "actuator_gain", "constant_load", "viscous_friction", "delay"]


class PositionLoop(EquationOfMotion):
    """A drive that follows a reference."""

    dt = 0.001
    state_channels = (
        Channel("position", "m", "position", scale=1.0),
        Channel("rate", "m/s", "rate", rate_of="position", scale=20.0),
    )
    action_channels = (Channel("aim", "m", "input", scale=1.0, low=-3.0, high=3.0),)
    parameters: ClassVar = {
        "gain": Parameter(60.0, "1/s", "of the loop", low=1.0),
        "time_constant": Parameter(0.03, "s", "of the drive", low=0.002),
    }

    def acceleration(self, q, v, u, force, p):
        return ((p.gain * (u[:, 0] - q[:, 0]) + force[:, 0] - v[:, 0]) / p.time_constant)[:, None]


def one_step(time_constant, seed):
    """A fifth of a second, of which one step; by an independent integrator."""
    times = np.arange(0, 0.2, 0.001)
    aim = np.where(times < 0.04, -0.5, 0.5)

    def slope(t, x):
        return [x[1], (60.0 * (np.interp(t, times, aim) - x[0]) - x[1]) / time_constant]

    found = solve_ivp(slope, (0, times[-1]), [-0.5, 0.0], t_eval=times, rtol=1e-8, max_step=5e-4)
    position = found.y[0] + np.random.default_rng(seed).normal(0, 0.02, len(times))
    states = np.stack([position, np.full(len(times), np.nan)], axis=1)
    return Trajectory("step", times, states, aim[:-1, None])


def named(result):
    return [v for v in result.verdicts if v.kind in ("confirmed", "ambiguous") and v.effect]


def test_a_step_that_eight_short_forecasts_do_not_show_is_seen_in_five_longer_ones():
    found = find_gap(PositionLoop(), [one_step(0.06, 1)], effects=OFFERED)
    (verdict,) = named(found)
    change = verdict.parameters["change"]
    assert verdict.effect == "time_constant" and change.low < 0.03 < change.high
    assert verdict.provisional
    assert any("there are more, but they name nothing" in one.says for one in found.quality)
    assert 5 <= found.gap.blocks < 8


@pytest.mark.parametrize("seed", [0, 1])
def test_without_a_gap_longer_forecasts_show_none_either(seed):
    found = find_gap(PositionLoop(), [one_step(0.03, seed)], effects=OFFERED)
    assert not named(found) and found.verdicts[0].kind == "no_gap"
    assert found.gap.blocks >= 8


def test_a_horizon_that_the_user_chose_stays():
    run = one_step(0.06, 1)
    found = find_gap(PositionLoop(), [run], effects=OFFERED, horizon=0.0187)
    assert not named(found) and found.gap.blocks >= 8
