"""A wall that warms with the air, which the simulator does not know, and nobody measures."""

from __future__ import annotations

import numpy as np
import pytest
from held import path

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter

DT, ROOM, CAPACITY, LOSS = 2.0, 20.0, 800.0, 5.0


class Oven(FirstOrderSystem):
    """Air that a heater warms, without walls."""

    dt = DT
    state_channels = (Channel("air", "degC", "other", scale=50.0),)
    action_channels = (Channel("power", "W", "input", scale=500.0, low=0.0, high=1000.0),)

    def __init__(self, **options):
        self.parameters = {
            "capacity": Parameter(CAPACITY, "J/K", "of the air", low=1.0),
            "loss": Parameter(LOSS, "W/K", "to the room", low=0.0),
        }
        super().__init__(**options)

    def derivative(self, x, u, p):
        return ((u[:, 0] - p.loss * (x[:, 0] - ROOM)) / p.capacity)[:, None]


def log(conductance, wall, seed=0):
    rng = np.random.default_rng(seed)
    power = np.repeat(rng.choice([0.0, 300.0, 600.0, 1000.0], 20), 30)

    def rates(_, x, watts):
        flow = conductance * (x[0] - x[1])
        return [(watts - LOSS * (x[0] - ROOM) - flow) / CAPACITY, flow / wall]

    air = path(rates, [ROOM, ROOM], power, DT)[:, :1]
    air = air + 0.3 * rng.standard_normal(air.shape)
    return Trajectory("oven", DT * np.arange(len(air)), air, power[:, None])


@pytest.mark.parametrize(
    ("conductance", "wall"), [pytest.param(8.0, 1600.0, marks=pytest.mark.long), (4.0, 400.0)]
)
def test_a_wall_is_named_with_its_rate_and_time(conductance, wall):
    found = find_gap(Oven(), [log(conductance, wall)])
    (named,) = [verdict for verdict in found.verdicts if verdict.parameters]
    assert (named.kind, named.label) == ("confirmed", "second_store@air")
    for field, truth in (("rate", conductance / CAPACITY), ("time", wall / conductance)):
        assert named.parameters[field].low <= truth <= named.parameters[field].high


def test_without_a_wall_none_is_named():
    assert not any(v.effect == "second_store" for v in find_gap(Oven(), [log(0.0, 1.0)]).verdicts)
