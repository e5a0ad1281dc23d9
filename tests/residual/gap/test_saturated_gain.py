"""A saturation cuts what comes out of the gain: beside a large one, beyond all raw commands."""

from typing import ClassVar

import numpy as np
import pytest

from residual.gap import find_gap
from residual.gap.fitting.plausible import absurd, told_by_data
from residual.gap.model.candidates import candidates
from residual.gap.model.model import Model
from residual.gap.preparation.prepare import prepare
from residual.trajectories import Trajectory
from sims.effects import Saturation
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


class Gear(FirstOrderSystem):
    """A gear motor at a fixed pulse width, 0 to 255 for its 12 V."""

    dt = 0.015
    state_channels = (Channel("speed", "rpm", "rate", scale=10.0),)
    action_channels = (Channel("pwm", "1", "input", scale=100.0, low=0.0, high=255.0),)
    parameters: ClassVar = {
        "full": Parameter(100.0, "rpm", "speed at full width", low=1.0),
        "tau": Parameter(0.06, "s", "time constant", low=0.005),
    }

    def derivative(self, x, u, p):
        return ((p.full * u[:, 0] / 255 - x[:, 0]) / p.tau)[:, None]


def test_one_constant_command_tells_of_no_limit():
    """A motor at one command, weaker than it should be: a limit below that would do as well."""
    rng = np.random.default_rng(0)
    times = 0.015 * np.arange(75.0)
    rest = 0.73 * 100 * 80 / 255
    speed = rest + (3.8 - rest) * np.exp(-times / 0.06) + 0.4 * rng.standard_normal(75)
    run = Trajectory("step", times, speed[:, None], np.full((74, 1), 80.0))
    prepared = prepare(Gear(), [run], 0.12)
    fitter, sigma = prepared.fitter, prepared.floor.sigma
    nominal = fitter.fit(Model(Gear()), np.zeros(0))
    limit = Model(Gear(), candidates(Gear(), [Saturation("pwm")], fitter.samples))
    fit = fitter.fit(limit, np.array([58.0]))
    assert "always beyond it" in absurd(limit, fit.theta, fitter.samples)[1]
    assert not told_by_data(fit, nominal, fitter, sigma)
    assert "saturation" not in [v.effect for v in find_gap(Gear(), [run]).verdicts]
