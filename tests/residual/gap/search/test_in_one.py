"""A loss to a room beside a jacket: one law where a gain and an exchange would do the same."""

from typing import ClassVar

import numpy as np
import pytest

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter

DT, EXCHANGE, FLOW = 0.5, 0.15, 0.12


class Tank(FirstOrderSystem):
    """A stirred tank in a jacket, its temperature in degC and times in minutes."""

    dt = DT
    state_channels = (Channel("tank", "degC", "other", scale=50.0),)
    action_channels = (Channel("jacket", "degC", "input", scale=50.0),)
    parameters: ClassVar = {
        "exchange": Parameter(EXCHANGE, "1/min", "with the jacket", low=0.0),
        "feed": Parameter(25.0, "degC", "temperature of the feed"),
    }

    def derivative(self, x, u, p):
        tank, jacket = x[:, 0], u[:, 0]
        return (FLOW * (p.feed - tank) + p.exchange * (jacket - tank))[:, None]


def runs(draws, against, constant, rows=160):
    """Of x' = constant + draws u - against x, jackets held for a while each."""
    rng, found = np.random.default_rng(3), []
    for number in range(3):
        jacket = np.repeat(rng.uniform(20, 80, rows // 20), 20)[:, None]
        tank, seen = 40.0, []
        for heated in jacket[:, 0]:
            seen.append(tank)
            end = (constant + draws * heated) / against
            tank = end + (tank - end) * np.exp(-against * DT)
        states = np.array(seen)[:, None] + rng.normal(0, 0.05, (rows, 1))
        found.append(Trajectory(f"run{number}", DT * np.arange(rows), states, jacket[:-1]))
    return found


def certain(found):
    return {v.effect: v for v in found.verdicts if v.kind == "confirmed"}


@pytest.mark.long
def test_a_loss_to_the_room_is_no_gain_and_exchange():
    found = certain(find_gap(Tank(), runs(EXCHANGE, FLOW + EXCHANGE + 0.03, FLOW * 25 + 0.66)))
    assert set(found) == {"proportional_loss", "constant_load"}
    (rate,) = found["proportional_loss"].parameters.values()
    assert rate.low < 0.03 < rate.high


def test_an_exchange_that_is_stronger_stays_one():
    found = find_gap(Tank(), runs(1.3 * EXCHANGE, FLOW + 1.3 * EXCHANGE, FLOW * 25))
    assert "proportional_loss" not in {verdict.effect for verdict in found.verdicts}
    assert "exchange" in certain(found)


def test_a_weaker_jacket_stays_one():
    found = find_gap(Tank(), runs(0.8 * EXCHANGE, FLOW + EXCHANGE, FLOW * 25))
    assert "proportional_loss" not in {verdict.effect for verdict in found.verdicts}
    assert "actuator_gain" in certain(found)


def test_nothing_is_lost_where_nothing_is():
    assert not certain(find_gap(Tank(), runs(EXCHANGE, FLOW + EXCHANGE, FLOW * 25)))
