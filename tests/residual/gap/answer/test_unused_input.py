"""An input that the simulator does not use is one that its parameters may follow."""

import numpy as np
import pytest

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter

#: What may be missing.
ASKED = ("lag", "constant_load", "actuator_lag", "actuator_gain")


class Thermometer(FirstOrderSystem):
    """It follows the water that runs past it, however fast that is."""

    dt = 0.25
    state_channels = (Channel("reading", "degC", "other", scale=5.0),)
    action_channels = (
        Channel("water", "degC", "input", scale=5.0),
        Channel("flow", "ml/s", "input", scale=5.0),
    )
    parameters = {"lag": Parameter(2.0, "s", "of the thermometer", low=0.1)}

    def derivative(self, x, u, p):
        return ((u[:, 0] - x[:, 0]) / p.lag)[:, None]


def record(rate, pieces):
    """One that follows at a rate by the flow, the water and the flow steady for four seconds each:
    in closed form."""
    waters, flows = np.repeat(np.array(pieces, float), 16, axis=0).T
    waters = np.convolve(np.append([waters[0]] * 19, waters), np.ones(20) / 20, "valid")
    readings = [88.0]
    for water, flow in zip(waters, flows, strict=True):
        readings.append(water + (readings[-1] - water) * np.exp(-0.25 * rate(flow)))
    noise = 0.03 * np.random.default_rng(0).standard_normal(len(readings))
    seen = (np.array(readings) + noise)[:, None]
    actions = np.stack([waters, flows], axis=1)
    return Trajectory("run", 0.25 * np.arange(len(seen)), seen, actions)


@pytest.mark.long
def test_a_time_constant_many_times_off_that_follows_the_flow_is_named_as_that():
    """Near the simulator's own value the linear picture shows nothing of it."""
    pieces = [
        (88, 4.0), (95, 8.0), (92, 8.0), (80, 2.0), (85, 0.4),
        (92, 0.4), (90, 1.0), (86, 1.5), (88, 1.5), (90, 1.5),
    ]  # fmt: skip
    found = find_gap(Thermometer(), record(lambda flow: 0.035 * flow, pieces), effects=ASKED)
    (curve,) = found.effects
    assert str(curve) == "parameter_curve@lag over flow"
    assert 2.0 + curve.at(1.0) > 3 * (2.0 + curve.at(7.0))
    assert found.gap.share.value > 0.99


def test_one_that_stays_the_same_is_a_number():
    rng = np.random.default_rng(0)
    pieces = rng.uniform((80, 0.5), (95, 8.0), (24, 2))
    found = find_gap(Thermometer(), record(lambda flow: 1 / 12.0, pieces), effects=ASKED)
    named = [(v.kind, v.where) for v in found.verdicts if v.kind in ("confirmed", "ambiguous")]
    assert named == [("confirmed", "lag")]
    (verdict,) = [v for v in found.verdicts if v.kind == "confirmed"]
    (number,) = verdict.parameters.values()
    assert number.value == pytest.approx(10.0, rel=0.03)
