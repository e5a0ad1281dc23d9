"""What swings on a spring, which the simulator does not know and nobody measures, is named."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest
from held import path as held_path

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.simulator import Channel, Parameter

SPRING, DAMPER = 200.0, 2.0


class Sled(EquationOfMotion):
    """A sled that is pushed, load and all."""

    dt = 0.01
    state_channels = (
        Channel("place", "m", "position", scale=0.5),
        Channel("speed", "m/s", "rate", rate_of="place", scale=1.0),
    )
    action_channels = (Channel("push", "N", "input", scale=20.0),)
    parameters: ClassVar = {
        "mass": Parameter(2.5, "kg", "of sled and load", low=0.01),
        "drag": Parameter(1.5, "N s/m", "of the snow", low=0.0),
    }

    def acceleration(self, q, v, u, force, p):
        return ((u[:, 0] - p.drag * v[:, 0] + force[:, 0]) / p.mass)[:, None]


class Motor(FirstOrderSystem):
    """A motor and what it drives as one, by its speed."""

    dt = 0.005
    state_channels = (Channel("speed", "rad/s", "rate", scale=50.0),)
    action_channels = (Channel("voltage", "V", "input", scale=12.0),)
    parameters: ClassVar = {"tau": Parameter(0.25, "s", "time constant", low=0.01)}

    def derivative(self, x, u, p):
        return ((8.0 * u[:, 0] - x[:, 0]) / p.tau)[:, None]


def held(rng, rows, each, size):
    return np.repeat(rng.uniform(-size, size, rows // each + 1), each)[:rows]


def path(rates, start, inputs, dt):
    return held_path(rates, start, inputs[:-1], dt, atol=1e-10)


def sleds(first, second, rows=600):
    """Runs of a sled of two masses on a spring; the first is pushed and measured."""
    rng = np.random.default_rng(1)

    def rates(_, x, u):
        pull = SPRING * (x[2] - x[0]) + DAMPER * (x[3] - x[1])
        return [x[1], (u - 1.5 * x[1] + pull) / first, x[3], -pull / second]

    for number in range(3):
        push = held(rng, rows, 40, 20.0)
        place = path(rates, [0, 0, 0, 0], push, 0.01)[:, 0] + 5e-4 * rng.standard_normal(rows)
        states = np.stack([place, np.full(rows, np.nan)], axis=1)
        yield Trajectory(f"run {number}", 0.01 * np.arange(rows), states, push[:-1, None])


#: What a load on a spring may be taken for.
OFFERED = ("mass", "drag", "coulomb_friction", "linear_spring", "delay", "flexible_part")


def test_a_load_on_a_spring_has_its_name_its_mass_and_its_frequency():
    result = find_gap(Sled(), list(sleds(2.0, 0.5)), effects=OFFERED)
    (named,) = (v for v in result.verdicts if v.kind == "confirmed")
    assert (named.effect, named.where) == ("flexible_part", "place")
    ratio, frequency = named.parameters["ratio"], named.parameters["frequency"]
    reduced = 2.0 * 0.5 / 2.5
    assert ratio.low < 0.5 / 2.0 < ratio.high
    assert frequency.value == pytest.approx(np.sqrt(SPRING / reduced) / (2 * np.pi), rel=0.01)
    assert frequency.unit == "Hz"
    assert result.gap.after.value < 0.3 * result.gap.before.value
    # The corrected simulator carries it, with its swing as a hidden state.
    corrected = result.corrected
    assert [channel.name for channel in corrected.state_channels][2:] == [
        "place part", "place part rate",
    ]  # fmt: skip


@pytest.mark.long
def test_a_shaft_that_twists_shows_in_the_speed_of_the_motor():
    rng = np.random.default_rng(2)
    swing, damping, ratio = 2 * np.pi * 15.0, 0.05, 0.6

    def rates(_, x, u):
        pull = (swing**2 * x[1] + 2 * damping * swing * x[2]) / (1 + ratio)
        quickens = (8.0 * u - x[0]) / 0.25 * (1 + ratio) + ratio * pull
        return [quickens, x[2], -pull - quickens]

    voltage = held(rng, 1200, 60, 10.0)
    speed = path(rates, [0, 0, 0], voltage, 0.005)[:, :1] + 0.1 * rng.standard_normal((1200, 1))
    run = Trajectory("run", 0.005 * np.arange(1200), speed, voltage[:-1, None])
    result = find_gap(Motor(), [run])
    (named,) = (v for v in result.verdicts if v.kind == "confirmed")
    assert named.effect == "flexible_part"
    for name, true in (("ratio", ratio), ("frequency", 15.0), ("damping", damping)):
        number = named.parameters[name]
        assert number.low <= true <= number.high
        assert number.value == pytest.approx(true, rel=0.15)


@pytest.mark.long
def test_a_sled_without_a_spring_has_none():
    runs = []
    rng = np.random.default_rng(3)
    for number in range(3):
        push = held(rng, 600, 40, 20.0)
        inputs = push[:-1, None]
        place = Sled(substeps=4).with_parameters(mass=2.9).rollout([0.0, 0.0], inputs)[:, 0]
        place += 5e-4 * rng.standard_normal(600)
        states = np.stack([place, np.full(600, np.nan)], axis=1)
        runs.append(Trajectory(f"run {number}", 0.01 * np.arange(600), states, inputs))
    result = find_gap(Sled(), runs, effects=OFFERED)
    assert [v.effect for v in result.verdicts if v.kind == "confirmed"] == ["mass"]
    asked = find_gap(Sled(), runs, effects=["mass", "flexible_part"])
    assert not any(v.effect == "flexible_part" for v in asked.verdicts if v.kind == "confirmed")
