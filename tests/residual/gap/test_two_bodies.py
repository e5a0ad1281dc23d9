"""Heat that goes from one body to the other, which the simulator does not know."""

from __future__ import annotations

import numpy as np
import pytest
from held import path

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter

DT, ROOM = 2.0, 21.0
POWER, LOSS, LIGHT, HEAVY = 0.05, 0.02, 2.0, 5.0


class Apart(FirstOrderSystem):
    """Two bodies, each in the room by itself; the first has a heater."""

    dt = DT
    state_channels = (
        Channel("light", "degC", "other", scale=10.0),
        Channel("heavy", "degC", "other", scale=10.0),
    )
    action_channels = (Channel("heater", "%", "input", scale=50.0, low=0.0, high=100.0),)

    def __init__(self, **options):
        self.parameters = {"loss": Parameter(LOSS, "W/K", "to the room, each", low=0.0)}
        super().__init__(**options)

    def derivative(self, x, u, p):
        light = (POWER * u[:, 0] - p.loss * (x[:, 0] - ROOM)) / LIGHT
        heavy = -p.loss * (x[:, 1] - ROOM) / HEAVY
        return np.stack([light, heavy], axis=1)


def log(conductance, seed=0):
    rng = np.random.default_rng(seed)
    steps = np.repeat(rng.choice([0.0, 20.0, 50.0, 90.0], 20), 30)
    times = DT * np.arange(len(steps) + 1)

    def rates(_, x, percent):
        flow = conductance * (x[0] - x[1])
        light = POWER * percent - LOSS * (x[0] - ROOM) - flow
        return [light / LIGHT, (flow - LOSS * (x[1] - ROOM)) / HEAVY]

    states = path(rates, [ROOM, ROOM], steps, DT)
    seen = states + 0.05 * rng.standard_normal(states.shape)
    return Trajectory("bodies", times, seen, steps[:, None])


@pytest.mark.parametrize("conductance", [pytest.param(0.015, marks=pytest.mark.long), 0.05])
def test_an_exchange_is_named_with_both_rates(conductance):
    found = find_gap(Apart(), [log(conductance)])
    (named,) = [verdict for verdict in found.verdicts if verdict.parameters]
    assert (named.kind, named.label) == ("confirmed", "exchange@light and heavy")
    for field, capacity in (("into_first", LIGHT), ("into_second", HEAVY)):
        number = named.parameters[field]
        assert number.low <= conductance / capacity <= number.high


def test_without_an_exchange_none_is_named():
    assert not any(v.effect == "exchange" for v in find_gap(Apart(), [log(0.0)]).verdicts)
