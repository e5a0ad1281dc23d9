"""A law with the wrong sign in the simulator: a curve makes up for it, and is not certain."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter

DT = 10.0


class Battery(FirstOrderSystem):
    """A cell that its own current warms, written with a current that cools it when it charges."""

    dt = DT
    state_channels = (Channel("cell", "degC", "other", scale=8.0),)
    action_channels = (
        Channel("current", "A", "input", scale=40.0),
        Channel("ambient", "degC", "input", scale=10.0, hold="linear"),
    )
    parameters: ClassVar = {
        "capacity": Parameter(900.0, "J/K", "heat capacity", low=10.0),
        "resistance": Parameter(0.02, "ohm", "inner resistance", low=1e-4),
        "transfer": Parameter(1.5, "W/K", "heat transfer", low=0.01),
    }

    def warmth(self, current):
        return np.abs(current) * current

    def derivative(self, x, u, p):
        warmed = p.resistance * self.warmth(u[:, 0]) - p.transfer * (x[:, 0] - u[:, 1])
        return (warmed / p.capacity)[:, None]


class Right(Battery):
    def warmth(self, current):
        return current**2


def records(rows=400, count=2):
    rng, found = np.random.default_rng(4), []
    for number in range(count):
        current = np.repeat(rng.uniform(-50, 70, rows // 25 + 1), 25)[:rows]
        ambient = 20 + np.cumsum(0.1 * rng.standard_normal(rows))
        inputs = np.column_stack([current, ambient])
        path = Right(dt=DT).rollout([22.0], inputs)
        seen = path + 0.1 * rng.standard_normal(path.shape)
        found.append(Trajectory(f"run {number}", DT * np.arange(rows + 1), seen, inputs))
    return found


@pytest.mark.long
def test_a_curve_that_turns_commands_round_is_told_and_not_certain():
    answer = find_gap(Battery(), records(), minutes=4)
    named = {verdict.label: verdict for verdict in answer.verdicts if verdict.parameters}
    curve = named["input_curve@current"]
    assert curve.kind == "ambiguous" and "extreme" in curve.doubts
    assert not any(verdict.kind == "confirmed" for verdict in answer.verdicts)
    assert curve.share.value > 0.9
