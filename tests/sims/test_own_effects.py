"""Effects of the user's own move as those of the library do."""

import dataclasses

import numpy as np
import pytest
from hosts import HOSTS, host, rows
from pendulum_reference import smooth_step

from sims.effects import (
    Cogging,
    CoulombFriction,
    DryFriction,
    JointEffect,
    number,
)


@dataclasses.dataclass(frozen=True)
class FanTorque(JointEffect):
    level: float = number(force=1, rate=-3, low=0.0)
    name = "fan_torque"
    sentence = "A torque that grows with the cube of speed."
    needs = "fast motion"

    def force(self, q, v):
        return -self.level * v * v * v


@host
def test_an_effect_of_the_users_own_is_hosted(host):
    effect = FanTorque("pivot", 2e-6)
    assert effect.quantities(HOSTS[host])["level"].unit == "N m s^3/rad^3"
    states, actions = rows(10)
    found = HOSTS[host].with_effects([effect]).step(states, actions)
    truth = [
        smooth_step(s, u, lambda q, w: -2e-6 * w**3)
        for s, u in zip(states, actions[:, 0], strict=True)
    ]
    assert found == pytest.approx(np.array(truth), abs=2e-5)


@dataclasses.dataclass(frozen=True)
class Seal(DryFriction):
    level: float = number(force=1, low=0.0)
    name = "seal"
    sentence = "Dry friction of the user's own."
    needs = "reversals of the motion"

    def limit(self, v):
        return self.level + 0.0 * v


@dataclasses.dataclass(frozen=True)
class Magnet(JointEffect):
    level: float = number(force=1)
    name = "magnet"
    sentence = "A torque of the user's own that depends on the angle alone."
    needs = "whole turns"
    follows_rate = False

    def force(self, q, v):
        return self.level * np.sin(3 * q)


@host
def test_effects_of_the_users_own_move_like_those_of_the_library(host):
    states, actions = rows(12)
    states[::3, 1] = 0.0
    levels = np.where(np.arange(12) % 2, 2e-3, 0.0)
    for own, known in (
        (Seal("pivot", levels), CoulombFriction("pivot", levels)),
        (Magnet("pivot", levels), Cogging("pivot", levels, 0.0, 3.0)),
    ):
        found, wanted = (HOSTS[host].with_effects([e]).step(states, actions) for e in (own, known))
        assert found == pytest.approx(wanted, abs=1e-12)
        assert np.array_equal(found[::2], HOSTS[host].step(states, actions)[::2])


@host
def test_what_goes_wrong_in_an_effect_of_the_users_own_is_raised(host):
    class Broken(Magnet):
        def force(self, q, v):
            raise KeyError("level of the magnet")

    with pytest.raises(KeyError, match="level of the magnet"):
        HOSTS[host].with_effects([Broken("pivot", 1e-3)]).step(*rows(2))
