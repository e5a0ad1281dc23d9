"""A state that falls at another pace than it rises: against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from sims.checks import check_simulator
from sims.effects import AsymmetricResponse, CoulombFriction
from sims.effects.library import further_in
from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.pendulum_equation import PendulumEquation
from sims.simulator import Channel

TAU, GAIN, BACK = 0.4, 3.0, -0.5


def follower(kind, unit):
    """A state that follows its input in a time constant."""

    class Follower(FirstOrderSystem):
        dt = 0.02
        state_channels = (Channel("x", unit, kind, scale=20.0),)
        action_channels = (Channel("input", "V", "input", scale=10.0),)

        def derivative(self, x, u, p):
            return (GAIN * u - x) / TAU

    return Follower()


@pytest.mark.parametrize(
    ("start", "end", "falls", "slows_down"),
    [(0, 8, 0, 0), (20, 5, 1, 1), (-20, -5, 0, 1), (-5, -20, 1, 0)],
)
@pytest.mark.parametrize("speed", [False, True])
def test_a_level_falls_slower_and_a_speed_slows_down_slower(start, end, falls, slows_down, speed):
    slow = slows_down if speed else falls
    simulator = follower(*(("rate", "rad/s") if speed else ("other", "m")))
    simulator = simulator.with_effects([AsymmetricResponse("x", BACK)])
    path = simulator.rollout([float(start)], np.full((30, 1), end / GAIN))[:, 0]
    tau = TAU / (1 + BACK) if slow else TAU
    assert path == pytest.approx(
        end + (start - end) * np.exp(-0.02 * np.arange(31) / tau), abs=1e-6
    )


def test_rows_have_a_pace_of_their_own_and_none_changes_no_bit():
    plain, rng = follower("rate", "rad/s"), np.random.default_rng(0)
    states, inputs = rng.normal(0, 20, (4, 1)), rng.normal(0, 5, (4, 1))
    paces, friction = np.array([0.0, -0.6, 1.5, -0.2]), CoulombFriction("x", 4.0)
    together = plain.with_effects([AsymmetricResponse("x", paces), friction]).step(states, inputs)
    for i in range(1, 4):
        alone = plain.with_effects([AsymmetricResponse("x", float(paces[i])), friction])
        assert np.array_equal(alone.step(states[[i]], inputs[[i]])[0], together[i])
    braked = plain.with_effects([friction])
    assert np.array_equal(together[:1], braked.step(states[:1], inputs[:1]))
    assert "failed" not in repr(check_simulator(plain.with_effects([AsymmetricResponse("x", 0.4)])))


class Wheel(EquationOfMotion):
    """A wheel whose angle is read, and which follows its input as a speed does."""

    dt = 0.02
    state_channels = (
        Channel("angle", "rad", "position", scale=10.0),
        Channel("speed", "rad/s", "rate", rate_of="angle", scale=20.0),
    )
    action_channels = (Channel("input", "V", "input", scale=10.0),)

    def acceleration(self, q, v, u, force, p):
        return (GAIN * u - v) / TAU + force


@pytest.mark.parametrize(("start", "end", "slow"), [(0, 8, 0), (20, 5, 1), (-20, -5, 1)])
def test_a_wheel_whose_angle_is_read_slows_down_slower(start, end, slow):
    wheel = Wheel(effects=[AsymmetricResponse("angle", BACK)])
    path = wheel.rollout([0.0, float(start)], np.full((30, 1), end / GAIN))
    times, tau = 0.02 * np.arange(31), TAU / (1 + BACK) if slow else TAU
    fading = (start - end) * np.exp(-times / tau)
    assert path[:, 1] == pytest.approx(end + fading, abs=1e-6)
    turned = end * times + tau * (start - end) * (1 - np.exp(-times / tau))
    assert path[:, 0] == pytest.approx(turned, abs=1e-6)
    assert "failed" not in repr(check_simulator(wheel))
    assert "asymmetric_response@angle" in map(str, further_in(Wheel()))


def test_it_is_for_states_of_first_order_and_wheels():
    assert "asymmetric_response@x" in map(str, further_in(follower("other", "degC")))
    with pytest.raises(ValueError, match="needs a state of a FirstOrderSystem"):
        PendulumEquation(effects=[AsymmetricResponse("pivot", 0.4)])
