"""A reaction of second order, where the simulator has one of first order."""

import numpy as np
import pytest
from held import path

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter


class Reactor(FirstOrderSystem):
    """A stirred tank that is fed, and a reaction in proportion to the concentration."""

    dt = 10.0
    state_channels = (Channel("c", "mol/L", "other", scale=1.0),)
    action_channels = (Channel("flow", "mL/s", "input", low=0.0, high=8.0, scale=3.0),)

    def __init__(self):
        self.parameters = {
            "volume": Parameter(1180.0, "mL", "volume", low=10.0),
            "feed": Parameter(2.0, "mol/L", "feed", low=0.01),
            "k": Parameter(0.0032, "1/s", "rate of the reaction", low=0.0),
        }
        super().__init__()

    def derivative(self, x, u, p):
        c = x[:, 0]
        return (u[:, 0] / p.volume * (p.feed - c) - p.k * c)[:, None]


def second_order(seed, n=700):
    """The reaction goes with the square of the concentration; the volume is 2 % off."""
    rng = np.random.default_rng(seed)
    flows = np.repeat(rng.uniform(0.5, 6.0, n // 70), 70)

    def rates(_, c, flow):
        return flow / 1200.0 * (2.0 - c) - 0.0032 * c**2

    c = path(rates, [0.6], flows, 10.0)[:-1, 0]
    seen = 0.002 * np.round((c + 0.006 * rng.standard_normal(n)) / 0.002)
    return Trajectory(f"run {seed}", 10.0 * np.arange(n), seen[:, None], flows[:-1, None])


@pytest.mark.parametrize("seed", [4, *(pytest.param(n, marks=pytest.mark.long) for n in (0, 2, 6))])
def test_a_bent_law_is_no_sum_of_straight_ones(seed):
    """A gain, a bias and a zero together come near, and a power or a curve nearer."""
    found = find_gap(Reactor(), [second_order(seed + run) for run in range(2)])
    sure = {v.effect for v in found.verdicts if v.kind == "confirmed"}
    assert sure <= {"state_curve", "power_loss", "k"}
    if seed != 6:  # its runs hardly leave half of the range
        assert {"state_curve", "power_loss"} & {v.effect for v in found.verdicts}
