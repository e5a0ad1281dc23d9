"""A saturation cuts what comes out of the gain: beside a large one, beyond all raw commands."""

from typing import ClassVar

import numpy as np
import pytest

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter

#: Truth: flow of a full command, what the pump can give in units of the nominal command, outflow.
GAIN, LEVEL, LOSS = 4.0, 1.6, 0.02
DT = 1.0


class Tank(FirstOrderSystem):
    dt = DT
    state_channels = (Channel("level", "cm", "other", scale=10.0),)
    action_channels = (Channel("pump", "1", "input", scale=1.0, low=0.0, high=1.0),)
    parameters: ClassVar = {"loss": Parameter(LOSS, "1/s", "outflow by the level")}

    def derivative(self, x, u, p):
        return (0.2 * u[:, 0] - p.loss * x[:, 0])[:, None]


def log(seed):
    """Random commands to a pump, its tank in closed form over every second."""
    rng = np.random.default_rng(seed)
    commands = np.repeat(rng.uniform(0, 0.8, 60), 10)
    level, levels = 5.0, [5.0]
    for command in commands:
        rest = 0.2 * min((1 + GAIN) * command, LEVEL) / LOSS
        level = rest + (level - rest) * np.exp(-LOSS * DT)
        levels.append(level)
    seen = np.array(levels) + 0.05 * rng.standard_normal(len(levels))
    times = DT * np.arange(float(len(levels)))
    return Trajectory("tank", times, seen[:, None], commands[:, None])


def test_both_are_found_with_their_numbers():
    found = find_gap(Tank(), [log(3)])
    named = {verdict.effect: verdict for verdict in found.verdicts if verdict.parameters}
    gain = named["actuator_gain"].parameters["gain"]
    level = named["saturation"].parameters["level"]
    assert gain.value == pytest.approx(GAIN, rel=0.1) and gain.low < GAIN < gain.high
    assert level.value == pytest.approx(LEVEL, rel=0.05) and level.low < LEVEL < level.high
    assert not level.at_bound
    assert found.gap.share.value > 0.98
