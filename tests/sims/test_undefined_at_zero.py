"""Motion that is not defined where all positions are zero, as of a load on a rope of no length."""

import warnings
from typing import ClassVar

import numpy as np
import pytest

from sims import Channel, EquationOfMotion, Parameter
from sims.checks import check_simulator
from sims.effects.aliases import exact_aliases
from sims.effects.library import library
from sims.effects.pull import pulled_by_position

LOAD = 8.0


class Hoist(EquationOfMotion):
    """A load that swings on a rope, which is hauled in and out."""

    dt = 0.02
    state_channels = (
        Channel("swing", "rad", "position", scale=0.3),
        Channel("rope", "m", "position", scale=1.0, low=0.2, high=4.0),
        Channel("swing_rate", "rad/s", "rate", rate_of="swing", scale=0.5),
        Channel("rope_rate", "m/s", "rate", rate_of="rope", scale=0.5),
    )
    action_channels = (Channel("winch", "N", "input", scale=60.0, low=-300.0, high=0.0),)
    parameters: ClassVar = {
        "load": Parameter(LOAD, "kg", "on the hook", low=0.5),
        "damping": Parameter(25.0, "N s/m", "of the winch", low=0.0, family="dissipation"),
    }

    def acceleration(self, q, v, u, force, p):
        swing, rope = q.T
        turned = (-2.0 * v[:, 1] * v[:, 0] - 9.81 * np.sin(swing)) / rope
        turned = turned + force[:, 0] / (p.load * rope**2)
        pull = u[:, 0] + force[:, 1] - p.damping * v[:, 1]
        return np.stack([turned, pull / p.load + rope * v[:, 0] ** 2 + 9.81 * np.cos(swing)], 1)


def test_every_effect_has_a_size_there():
    hoist = Hoist()
    for effect in library(hoist):
        for name, number in effect.quantities(hoist).items():
            assert np.isfinite(number.scale) and number.scale > 0, f"{effect} {name}"


def test_the_typical_force_is_that_of_a_usual_place():
    swing, rope = Hoist().joints
    at_one_metre = 0.5 / (10 * 0.02) * LOAD
    assert 0.05 * at_one_metre < Hoist().force_scale(swing) < at_one_metre
    assert Hoist().force_scale(rope) == pytest.approx(0.5 / (10 * 0.02) * LOAD)


def test_gravity_pulls_at_it_and_nothing_is_said_of_a_division_by_zero():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert pulled_by_position(Hoist(), "swing")
        alike = [set(alias.effects) for alias in exact_aliases(Hoist())]
    assert {"viscous_friction@rope", "damping"} in alike


def test_it_keeps_the_contract():
    assert all(finding.ok for finding in check_simulator(Hoist()))
