"""A boat in a current, and drones in a wind, that nobody told the simulator of."""

import numpy as np
import pytest
from held import path

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter


class Boat(EquationOfMotion):
    """Its way over ground by satellite, and its thrust."""

    dt = 0.2
    state_channels = (
        Channel("x", "m", "position", invariant=True),
        Channel("u", "m/s", "rate", rate_of="x", scale=1.0),
    )
    action_channels = (Channel("thrust", "N", "input", scale=60.0, low=-120.0, high=120.0),)

    def __init__(self):
        self.parameters = {
            "mass": Parameter(60.0, "kg", "mass, water that moves along included", low=1.0),
            "linear": Parameter(22.0, "N s/m", "drag", low=0.0, family="dissipation"),
            "square": Parameter(25.0, "N s^2/m^2", "drag", low=0.0, family="dissipation"),
        }
        super().__init__()

    def acceleration(self, q, v, u, force, p):
        speed = v[:, 0]
        drag = p.linear * speed + p.square * speed * np.abs(speed)
        return ((u[:, 0] - drag + force[:, 0]) / p.mass)[:, None]


def measured(seed, current, n=600):
    """Thrusts for 10 s each, parameters 1 % off, rounded readings."""
    rng = np.random.default_rng(seed)
    thrusts = np.repeat(rng.uniform(-60, 110, n // 50), 50)

    def rates(_, y, thrust):
        w = y[1] - current
        return [y[1], (thrust - 22.2 * w - 24.8 * w * abs(w)) / 60.6]

    return read(f"run {seed}", path(rates, [0.0, 0.0], thrusts, 0.2), thrusts, 0.02, 0.2, rng)


def read(name, states, inputs, noise, dt, rng):
    """Rounded readings of positions, each followed by its rate."""
    inputs = np.array(inputs).reshape(len(states) - 1, -1)
    width = 2 * inputs.shape[1]
    spread = np.tile([noise, 0.01], width // 2)
    seen = states[:-1, :width] + spread * rng.standard_normal((len(inputs), width))
    times = dt * np.arange(len(inputs))
    return Trajectory(name, times, np.round(seen, 2), inputs[:-1])


@pytest.mark.long
def test_a_current_is_named_in_place_of_the_loads_and_dampers_that_it_looks_like():
    found = find_gap(Boat(), [measured(seed, 0.35) for seed in range(3)])
    sure = [v for v in found.verdicts if v.kind == "confirmed"]
    assert [v.label for v in sure] == ["ambient_flow@x"]
    (speed,) = sure[0].parameters.values()
    assert speed.low < 0.35 < speed.high and speed.high - speed.low < 0.05


class Drone(EquationOfMotion):
    """Along x by its pitch, which it is taken to reach at once."""

    dt = 0.04
    state_channels = (
        Channel("x", "m", "position", invariant=True),
        Channel("v", "m/s", "rate", rate_of="x", scale=4.0),
    )
    action_channels = (Channel("pitch", "rad", "input", scale=0.3, low=-0.6, high=0.6),)

    def __init__(self):
        self.parameters = {
            "mass": Parameter(1.3, "kg", "mass", low=0.1),
            "rotors": Parameter(0.22, "N s/m", "drag", low=0.0, family="dissipation"),
            "body": Parameter(0.05, "N s^2/m^2", "drag", low=0.0, family="dissipation"),
        }
        super().__init__()

    def acceleration(self, q, v, u, force, p):
        speed = v[:, 0]
        drag = p.rotors * speed + p.body * speed * np.abs(speed)
        return (9.81 * np.tan(u[:, 0]) + (force[:, 0] - drag) / p.mass)[:, None]


def flown(seed, n=500):
    """In a wind of 2.2 m/s, the pitch 0.16 s late."""
    rng = np.random.default_rng(seed)
    pitches = np.repeat(rng.uniform(-0.3, 0.3, n // 25), 25)

    def rates(_, y, pitch):
        w = y[1] - 2.2
        drag = 0.224 * w + 0.0493 * w * abs(w)
        return [y[1], 9.81 * np.tan(y[2]) - drag / 1.32, (pitch - y[2]) / 0.16]

    flight = path(rates, np.zeros(3), pitches, 0.04)
    return read(f"flight {seed}", flight, pitches, 0.01, 0.04, rng)


@pytest.mark.long
def test_a_wind_is_named_in_place_of_the_bias_that_it_looks_like():
    found = find_gap(Drone(), [flown(seed) for seed in range(3)])
    sure = {v.label: v for v in found.verdicts if v.kind == "confirmed"}
    assert "ambient_flow@x" in sure
    assert not {"actuator_bias@pitch", "constant_load@x"} & set(sure)
    (speed,) = sure["ambient_flow@x"].parameters.values()
    assert speed.low < 2.2 < speed.high and speed.high - speed.low < 0.4


class OverGround(EquationOfMotion):
    """A drone along x and y, whose drag both speeds make."""

    dt = 0.05
    state_channels = (
        Channel("x", "m", "position", invariant=True),
        Channel("vx", "m/s", "rate", rate_of="x", scale=4.0),
        Channel("y", "m", "position", invariant=True),
        Channel("vy", "m/s", "rate", rate_of="y", scale=4.0),
    )
    action_channels = (
        Channel("pitch", "rad", "input", scale=0.3, low=-0.6, high=0.6),
        Channel("roll", "rad", "input", scale=0.3, low=-0.6, high=0.6),
    )

    def __init__(self):
        self.parameters = {
            "mass": Parameter(1.3, "kg", "mass", low=0.1),
            "body": Parameter(0.09, "N s^2/m^2", "drag", low=0.0, family="dissipation"),
        }
        super().__init__()

    def acceleration(self, q, v, u, force, p):
        drag = p.body * np.hypot(v[:, 0], v[:, 1])[:, None] * v
        return 9.81 * np.tan(u) + (force - drag) / p.mass


def over_ground(seed, wind, n=500):
    """Pitch and roll for 1.25 s each, parameters 1 % off."""
    rng = np.random.default_rng(seed)
    tilts = [tuple(two) for two in rng.uniform(-0.3, 0.3, (n // 25, 2)) for _ in range(25)]

    def rates(_, y, tilt):
        w = y[1::2] - wind
        ax, ay = 9.81 * np.tan(tilt) - 0.0909 * np.hypot(*w) * w / 1.29
        return [y[1], ax, y[3], ay]

    return read(f"flight {seed}", path(rates, np.zeros(4), tilts, 0.05), tilts, 0.01, 0.05, rng)


@pytest.mark.long
def test_one_wind_along_two_axes_is_named_in_place_of_two_pushes():
    """Drag couples them: with the wind along one axis alone the other's drag stays wrong."""
    wind = np.array([3.0, -1.5])
    found = find_gap(OverGround(), [over_ground(seed, wind) for seed in range(3)])
    sure = {v.label: v for v in found.verdicts if v.kind == "confirmed"}
    assert set(sure) == {"ambient_flow@x", "ambient_flow@y"}
    for axis, true in zip("xy", wind, strict=True):
        (speed,) = sure[f"ambient_flow@{axis}"].parameters.values()
        assert speed.low < true < speed.high and speed.high - speed.low < 0.4
