"""Parameters that are a little off, one of which was named, are looked at together."""

from typing import ClassVar

import numpy as np
import pytest
from held import path

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter

DT, ROWS = 0.1, 900


class Grid(FirstOrderSystem):
    """Frequency and governor of a small diesel grid."""

    dt = DT
    state_channels = (
        Channel("freq", "Hz", "other", scale=0.5),
        Channel("power", "kW", "other", scale=30.0),
    )
    action_channels = (Channel("load", "kW", "input", scale=30.0, low=-200.0, high=200.0),)
    parameters: ClassVar = {
        "M": Parameter(28.0, "kW s/Hz", "rotating mass", low=1.0),
        "D": Parameter(5.5, "kW/Hz", "load's own", low=0.0),
        "droop": Parameter(40.0, "kW/Hz", "governor", low=0.0),
        "T": Parameter(0.9, "s", "fuel rack", low=0.05),
    }

    def derivative(self, x, u, p):
        freq, power = x[:, 0], x[:, 1]
        return np.stack(
            [(power - u[:, 0] - p.D * freq) / p.M, (-p.droop * freq - power) / p.T], axis=1
        )


def steps(seed, mass, own, droop, rack):
    rng = np.random.default_rng(seed)
    load = np.repeat(rng.uniform(-40, 40, ROWS // 30), 30)[: ROWS - 1]

    def rates(_, x, u):
        return [(x[1] - u - own * x[0]) / mass, (-droop * x[0] - x[1]) / rack]

    states = path(rates, [0.0, 0.0], load, DT)
    noise = rng.standard_normal(states.shape) * [0.0023, 0.23]
    for row in range(1, ROWS):
        noise[row] += 0.7 * noise[row - 1]
    seen = states + noise
    return Trajectory(f"run {seed}", DT * np.arange(ROWS), seen, load[:, None])


@pytest.mark.long
def test_four_that_are_a_percent_or_two_off_are_calibrated_not_one_of_them_named():
    truth = (28.0 * 0.985, 5.5 * 1.02, 40.0 * 1.015, 0.9 * 1.02)
    found = find_gap(Grid(), [steps(seed, *truth) for seed in (1, 2, 3)])
    assert not [v.label for v in found.verdicts if v.kind in ("confirmed", "ambiguous")]
    assert "calibrated" in [v.kind for v in found.verdicts]
    moved = {effect.parameter: effect.change for effect in found.corrected.effects}
    values = [Grid.parameters[name].value + moved[name] for name in ("M", "D", "droop", "T")]
    assert np.allclose(values, truth, rtol=0.01)
