"""Where nothing can be named over the usual length, forecasts over a whole period are asked."""

from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest
from swing import noisy

from residual.gap import find_gap, longer
from residual.gap.preparation.horizon import longest_horizon, usual_horizon
from residual.trajectories import Trajectory
from sims.equations import EquationOfMotion
from sims.pendulum_equation import PendulumEquation
from sims.simulator import Channel, Parameter

PENDULUM = PendulumEquation()


def answer(adequate):
    """An empty one, of a log of which the nominal simulator leaves noise, or more."""
    return SimpleNamespace(found=SimpleNamespace(nominal_left=SimpleNamespace(adequate=adequate)))


def asked(rows, adequate, monkeypatch, near=False):
    monkeypatch.setattr(longer, "summed_up", lambda _: None)
    monkeypatch.setattr(longer, "within_noise", lambda _: near)
    run = noisy(n=rows)
    log = SimpleNamespace(horizon=usual_horizon(PENDULUM, [run]), recorded=[run])
    return log.horizon, longer.longer_horizon(PENDULUM, log, answer(adequate)), run


def test_a_gap_is_asked_about_over_a_period(monkeypatch):
    usual, found, _ = asked(400, False, monkeypatch)
    # A sine of 2 rad/s.
    assert usual == pytest.approx(np.pi / 3, rel=0.2)
    assert found == pytest.approx(np.pi, rel=0.2)


def test_a_short_log_holds_at_least_five_of_them(monkeypatch):
    _, found, run = asked(160, False, monkeypatch)
    assert found == longest_horizon([run], 5)


@pytest.mark.parametrize(("adequate", "near"), [(True, False), (False, True)])
def test_without_a_gap_nothing_more_is_asked_of_a_long_log(adequate, near, monkeypatch):
    assert asked(400, adequate, monkeypatch, near)[1] is None


class Ball(EquationOfMotion):
    """It rolls on a level rail that somebody tilts a little."""

    dt = 0.1
    state_channels = (
        Channel("x", "m", "position", scale=0.05),
        Channel("v", "m/s", "rate", rate_of="x", scale=0.1),
    )
    action_channels = (Channel("tilt", "rad", "input", scale=0.1),)
    parameters: ClassVar = {"gravity": Parameter(5.0, "m/s^2", "along the rail", low=0.1)}

    def acceleration(self, q, v, u, force, p):
        return (p.gravity * u[:, 0] + force[:, 0])[:, None]


def rolled(seed, push):
    """Four seconds of tilts to and fro in a wind, seen by a rough sonar."""
    rng = np.random.default_rng(seed)
    tilt = np.repeat(0.02 * rng.standard_normal(10), 4)
    tilt -= tilt.mean()
    x, v, seen = 0.0, 0.0, []
    for u in np.append(tilt, 0.0):
        seen.append(x)
        change = 5.0 * u + push
        x, v = x + 0.1 * v + 0.005 * change, v + 0.1 * change
    read = np.array(seen) + 0.01 * rng.standard_normal(len(seen))
    states = np.column_stack([read, np.full(len(seen), np.nan)])
    return Trajectory("run", 0.1 * np.arange(len(seen)), states, tilt[:, None])


def verdict(seed, push):
    found = find_gap(Ball(), [rolled(seed, push)], effects=["viscous_friction", "actuator_gain"])
    return found, found.verdicts[0].kind


SEEDS = [0, 1, *(pytest.param(seed, marks=pytest.mark.long) for seed in (2, 3))]


@pytest.mark.parametrize("seed", SEEDS)
def test_a_slow_error_beneath_rough_readings_is_a_gap(seed):
    """Over the usual length noise hides a push that carries the ball off."""
    found, kind = verdict(seed, push=0.06)
    assert kind != "no_gap" and found.gap.before.value > 5 * found.gap.noise_floor.value


@pytest.mark.parametrize("seed", SEEDS)
def test_rough_readings_alone_are_none(seed):
    assert verdict(seed, push=0.0)[1] in ("no_gap", "needs_data")
