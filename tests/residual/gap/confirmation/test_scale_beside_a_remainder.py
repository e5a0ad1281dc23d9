"""A sensor's scale that is wrong is certain only if nothing else is left to be explained."""

from __future__ import annotations

import numpy as np
import pytest

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.effects import SensorScale
from sims.equations import EquationOfMotion
from sims.simulator import Channel

DT = 0.02


class Hanging(EquationOfMotion):
    """A pendulum that a torque swings far about its lowest point."""

    dt = DT
    state_channels = (
        Channel("angle", "rad", "position"),
        Channel("rate", "rad/s", "rate", rate_of="angle", scale=5.0),
    )
    action_channels = (Channel("torque", "N m", "input", low=-20.0, high=20.0),)

    def acceleration(self, q, v, u, force, p):
        return -25.0 * np.sin(q) - 0.5 * v + u + force


class Rough(Hanging):
    """Its bearing drags in ripples, by position and by a power of speed: no law of the library."""

    def acceleration(self, q, v, u, force, p):
        return super().acceleration(q, v, u, force - np.sin(9.0 * q + 2.0) * np.abs(v), p)


def log(simulator):
    rng = np.random.default_rng(1)
    torque = np.repeat(rng.uniform(-10.0, 10.0, (1, 60, 1)), 20, axis=1)
    states = simulator(effects=[SensorScale("angle", -0.12)]).rollout(np.zeros((1, 2)), torque)[0]
    states[:, 0] += 0.002 * rng.standard_normal(len(states))
    states[:, 1] = np.nan
    return Trajectory("run", DT * np.arange(len(states)), states, torque[0])


@pytest.mark.parametrize(("simulator", "certain"), [(Hanging, True), (Rough, False)])
def test_a_scale_is_certain_only_if_no_remainder_is_left(simulator, certain):
    offered = ["sensor_scale@angle", "coulomb_friction@angle"]
    found = find_gap(Hanging(), [log(simulator)], effects=offered, minutes=0.5)
    verdict = next(v for v in found.verdicts if v.effect == "sensor_scale")
    assert (verdict.kind == "confirmed") is certain
    assert ("sensor" in verdict.doubts) is not certain
