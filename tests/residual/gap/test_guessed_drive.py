"""Two wheels on one command of which nothing was measured: gain, time constant and friction.

Truth by Euler's method in steps of a hundredth of a sample; dry friction holds as it is defined.
"""

from typing import ClassVar

import numpy as np
import pytest

from residual.gap.model.candidates import candidates
from residual.gap.preparation.prepare import prepare
from residual.gap.search import beam
from residual.gap.search.sets import Search
from residual.trajectories import Trajectory
from sims.chosen import chosen_effects
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter

DT = 0.02
#: Truth: speed for a count, time constant, and the count from which wheels turn.
SPEED, SLOW, HELD = 0.32, 0.05, 50.0
SIDES = ("left", "right")


class Wheels(EquationOfMotion):
    dt = DT
    state_channels = tuple(
        channel
        for side in SIDES
        for channel in (
            Channel(side, "rad", "position", scale=10.0),
            Channel(f"{side} rate", "rad/s", "rate", rate_of=side, scale=20.0),
        )
    )
    action_channels = (Channel("pwm", "1", "input", scale=150.0, low=-255.0, high=255.0),)
    parameters: ClassVar = {
        "speed": Parameter(0.2, "rad/s", "for one count", low=0.01),
        "slow": Parameter(0.1, "s", "time constant", low=0.005),
    }

    def acceleration(self, q, v, u, force, p):
        drive = p.speed * u[:, 0]
        return np.stack([(drive - v[:, i]) / p.slow + force[:, i] for i in range(2)], axis=1)


def turned(commands, speed, held):
    """Angle of a wheel, by an encoder of 275 counts a turn."""
    angle, rate, angles = 0.0, 0.0, [0.0]
    for command in commands:
        for _ in range(100):
            drive, dry = speed * command / SLOW, speed * held / SLOW
            if rate == 0 and abs(drive) <= dry:
                continue
            way = np.sign(rate) if rate else np.sign(drive)
            after = rate + 0.01 * DT * (drive - rate / SLOW - way * dry)
            rate = 0.0 if rate * after < 0 else after
            angle += 0.01 * DT * rate
        angles.append(angle)
    step = 2 * np.pi / 275
    return step * np.round(np.array(angles) / step)


def log(seed):
    """Ramps of the command up and down, with sudden turns."""
    rng = np.random.default_rng(seed)
    ramp = np.r_[np.linspace(10, 152, 50), np.linspace(-152, -10, 50)]
    commands = np.r_[ramp, ramp[::-1]] + rng.uniform(-5, 5)
    sides = [turned(commands, SPEED, HELD), turned(commands, 1.05 * SPEED, 0.96 * HELD)]
    none = np.full(len(commands) + 1, np.nan)
    seen = np.column_stack([sides[0], none, sides[1], none])
    return Trajectory("run", DT * np.arange(len(seen)), seen, commands[:, None])


@pytest.mark.long
def test_a_search_that_explains_little_tries_all_three(monkeypatch):
    monkeypatch.setattr(beam, "FOUND", 0.0)  # whatever two of them explain
    names = ("actuator_gain@pwm", "dead_zone@pwm", "slow")
    ready = prepare(Wheels(), [log(0)], 0.5)
    offered = chosen_effects(Wheels(), [*names, "coulomb_friction", "constant_load"])
    pool = candidates(Wheels(), offered, ready.fitter.samples)
    search = Search(Wheels(), pool, ready.fitter, noise=ready.floor.sigma)
    places = [[candidate.label for candidate in pool].index(name) for name in names]
    beam.grow(search, ())
    two = min(search.error(key) for key in search.usable() if len(key) < 3)
    beam.guessed_drives(search)
    fit = search.tried[tuple(sorted(places))]
    assert search.error(tuple(sorted(places))) < 0.5 * two
    (gain, dead, slow) = fit.model.bind(fit.theta).effects
    assert 1 + gain.gain == pytest.approx(SPEED / 0.2, rel=0.1)
    assert dead.width == pytest.approx(HELD, rel=0.1)
    assert 0.1 + slow.change == pytest.approx(SLOW, rel=0.3)
