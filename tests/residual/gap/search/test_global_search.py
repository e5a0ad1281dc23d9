"""A motor that starts and stops: slopes end in wrong minima, so numbers are sought globally."""

from __future__ import annotations

import time
from typing import ClassVar

import numpy as np
import pytest

from residual.gap.find import find_gap
from residual.gap.model.candidates import candidates
from residual.gap.preparation.prepare import prepare
from residual.gap.result import GapResult
from residual.gap.search.sets import Search
from residual.trajectories import Trajectory
from sims.chosen import chosen_effects
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter

#: Truth: speed of a count, time constant, and friction in counts of the command and rad/s.
GAIN, LAG, SLIDING, BREAKAWAY, SPEED = 0.42, 0.2, 60.0, 110.0, 3.0
DT, SECONDS, TOP = 0.02, 12.0, 255.0


class Motor(FirstOrderSystem):
    dt = DT
    state_channels = (Channel("speed", "rad/s", "rate", scale=10.0),)
    action_channels = (Channel("pwm", "1", "input", scale=100.0, low=-TOP, high=TOP),)
    parameters: ClassVar = {
        "gain": Parameter(0.2, "rad/s", "speed of a count"),
        "time_constant": Parameter(0.15, "s", "time constant"),
    }

    def derivative(self, x, u, p):
        return ((p.gain * u[:, 0] - x[:, 0]) / p.time_constant)[:, None]


def ramps(fine: int = 100) -> Trajectory:
    """A log to full speed, to full speed backwards, to rest: explicit Euler, sticking by cases."""
    times = DT * np.arange(round(SECONDS / DT))
    commands = TOP * np.interp(times / SECONDS, [0, 0.25, 0.75, 1], [0, 1, -1, 0])
    speed, speeds = 0.0, []
    for command in commands:
        speeds.append(speed)
        for _ in range(fine):
            if speed == 0 and abs(command) <= BREAKAWAY:
                continue
            way = np.sign(speed) if speed else np.sign(command)
            friction = SLIDING + (BREAKAWAY - SLIDING) * np.exp(-((speed / SPEED) ** 2))
            after = speed + DT / fine * (GAIN * (command - way * friction) - speed) / LAG
            speed = 0.0 if speed * after < 0 else after
    noise = 0.1 * np.random.default_rng(3).standard_normal(len(speeds))
    states = (np.array(speeds) + noise)[:, None]
    return Trajectory("ramps", times, states, commands[:-1, None])


#: Enough to be wrong with.
OFFERED = ("stribeck_friction", "coulomb_friction", "gain", "time_constant")


@pytest.fixture(scope="module")
def motor() -> GapResult:
    return find_gap(Motor(), [ramps()], effects=OFFERED)


@pytest.mark.long
def test_a_motor_has_stribeck_friction_and_another_gain(motor: GapResult) -> None:
    named = {v.effect for v in motor.verdicts if v.kind in ("confirmed", "ambiguous")}
    assert {"stribeck_friction", "gain"} <= named


@pytest.mark.long
def test_nothing_else_is_certain(motor: GapResult) -> None:
    certain = {v.effect for v in motor.verdicts if v.kind == "confirmed"}
    assert certain <= {"stribeck_friction", "gain", "time_constant"}


@pytest.mark.long
def test_forecasts_err_by_less_than_slopes_alone_reach(motor: GapResult) -> None:
    # Coulomb friction and a gain, where slopes end, leave a third.
    assert motor.gap.after.value < 0.2 * motor.gap.before.value


@pytest.mark.parametrize("globally", [False, True])
def test_slopes_alone_end_in_a_wrong_minimum(globally: bool) -> None:
    simulator, noise = Motor(), np.array([0.1])
    ready = prepare(simulator, [ramps(20)], 3.0)
    offered = chosen_effects(simulator, ("stribeck_friction", "gain"))
    pool = candidates(simulator, offered, ready.fitter.samples)
    until = time.process_time() + 40.0
    search = Search(
        simulator, pool, ready.fitter, until=until, noise=noise if globally else None
    )  # fmt: skip
    key = tuple(range(len(pool)))
    search.add({(): np.zeros(0)})
    search.add({key: np.concatenate([one.trials[0].values[0] for one in pool])})
    fitted = {str(e): e for e in search.model(key).bind(search.tried[key].theta).effects}
    # With the simulator's own time constant, in rad/s^2.
    true = BREAKAWAY * GAIN / 0.15
    right = fitted["stribeck_friction@speed"].breakaway == pytest.approx(true, rel=0.05)
    assert right == globally
