"""What falls at its final speed: a drag that follows the height is a force by height there."""

import numpy as np
import pytest
from held import path

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter

WEIGHT, DRAG, SCALE = 0.4 * 9.81, 0.0267, 8400.0


class Oil(EquationOfMotion):
    """A ball that sinks in oil, which is alike everywhere."""

    dt = 0.05
    state_channels = (
        Channel("depth", "m", "position", scale=0.5),
        Channel("speed", "m/s", "rate", rate_of="depth", scale=0.3),
    )
    action_channels = ()

    def __init__(self):
        self.parameters = {
            "mass": Parameter(0.02, "kg", "of the ball", low=0.001),
            "drag": Parameter(0.25, "N s/m", "of the oil", low=0.0, family="dissipation"),
        }
        super().__init__()

    def acceleration(self, q, v, u, force, p):
        drag = np.reshape(p.drag * v[:, 0], (-1, 1))
        return 9.81 * 0.6 + (force - drag) / np.reshape(p.mass, (-1, 1))


def sunk(seed, speed, n=90):
    """Let go at a speed, in oil that is thicker down there."""
    rng = np.random.default_rng(seed)

    def rates(_, x, u):
        thick = 0.25 * (1 + 1.5 * (x[0] / 1.2) ** 2)
        return [x[1], 9.81 * 0.6 - thick * x[1] / 0.02]

    seen = path(rates, [0.0, speed], np.zeros(n), 0.05)
    seen = seen + rng.normal(0.0, (1e-3, 4e-3), seen.shape)
    return Trajectory(f"ball {seed}", 0.05 * np.arange(n + 1), seen, np.zeros((n, 0)))


class Parachute(EquationOfMotion):
    """A sonde under a parachute, in air that is as dense everywhere."""

    dt = 1.0
    state_channels = (
        Channel("height", "m", "position", scale=5000.0),
        Channel("climb", "m/s", "rate", rate_of="height", scale=20.0),
    )
    action_channels = ()

    def __init__(self):
        self.parameters = {
            "mass": Parameter(0.4, "kg", "of all", low=0.01),
            "drag": Parameter(0.0272, "N s^2/m^2", "of the parachute", low=0.0,
                              family="dissipation"),
        }  # fmt: skip
        super().__init__()

    def acceleration(self, q, v, u, force, p):
        drag = p.drag * v[:, 0] * np.abs(v[:, 0])
        return -9.81 + (force - np.reshape(drag, (-1, 1))) / np.reshape(p.mass, (-1, 1))


def dropped(seed, height, n):
    """From a height, in air that is thinner up there."""
    rng = np.random.default_rng(seed)

    def rates(_, x, u):
        drag = DRAG * np.exp(-x[0] / SCALE) * x[1] * abs(x[1])
        return [x[1], -9.81 - drag / 0.4]

    seen = path(rates, [height, -5.0], np.zeros(n), 1.0)
    seen = seen + rng.normal(0.0, (2.0, 0.1), seen.shape)
    return Trajectory(f"drop {seed}", np.arange(n + 1.0), seen, np.zeros((n + 1, 0))[:-1])


@pytest.mark.long
def test_neither_is_certain_and_the_true_one_is_told():
    drops = ((12000.0, 620), (11000.0, 580), (9000.0, 500), (7500.0, 430), (6000.0, 360))
    found = find_gap(Parachute(), [dropped(n, *drop) for n, drop in enumerate(drops)])
    assert not [v for v in found.verdicts if v.kind == "confirmed"]
    told = [name for v in found.verdicts for name in (v.label, *v.alternatives)]
    assert any(name.startswith("parameter_curve@drag over height") for name in told)


@pytest.mark.long
def test_oil_that_is_thicker_below_is_no_spring():
    found = find_gap(Oil(), [sunk(n, speed) for n, speed in enumerate((0.0, 0.1, 0.2, 0.3, 0.4))])
    sure = {v.effect for v in found.verdicts if v.kind == "confirmed"}
    assert sure <= {"parameter_curve", "drag", "mass"}
    told = [name for v in found.verdicts for name in (v.label, *v.alternatives)]
    assert any(name.startswith("parameter_curve@drag over depth") for name in told)
