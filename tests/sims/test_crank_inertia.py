"""Inertia by the angle: a slider-crank by SciPy, and where it is looked for."""

from typing import ClassVar

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sims.checks import check_simulator
from sims.effects import CoulombFriction, CrankInertia, library
from sims.effects.library import further_in
from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.pendulum import Pendulum
from sims.simulator import Channel, Parameter

FLYWHEEL, SLIDE, RADIUS = 0.05, 2.0, 0.1


class Wheel(EquationOfMotion):
    """A flywheel on a motor."""

    dt, substeps, unit = 0.01, 5, "rad"
    state_channels = (
        Channel("angle", "rad", "position"),
        Channel("speed", "rad/s", "rate", rate_of="angle", scale=10.0),
    )
    action_channels = (Channel("torque", "N m", "input", scale=1.0),)
    parameters: ClassVar = {"inertia": Parameter(FLYWHEEL, "kg m^2", "of the flywheel")}

    def acceleration(self, q, v, u, force, p):
        return (u + force) / np.reshape(p.inertia, (-1, 1))


class InDegrees(Wheel):
    state_channels = (
        Channel("angle", "deg", "position"),
        Channel("speed", "deg/s", "rate", rate_of="angle", scale=500.0),
    )

    def acceleration(self, q, v, u, force, p):
        return np.degrees(super().acceleration(q, v, u, force, p))


def crank(angle):
    """A slide on a long rod: what it adds to the inertia of the flywheel."""
    return SLIDE * RADIUS**2 * np.sin(angle) ** 2


def test_a_slide_on_a_crank_moves_as_lagrange_says():
    def rates(_, x):
        slope = SLIDE * RADIUS**2 * np.sin(2 * x[0])
        return [x[1], (0.4 - 0.5 * slope * x[1] ** 2) / (FLYWHEEL + crank(x[0]))]

    truth = solve_ivp(
        rates, (0, 2), [0.3, 2.0], t_eval=0.01 * np.arange(201), rtol=1e-10, atol=1e-12
    ).y
    mean = 0.5 * SLIDE * RADIUS**2
    wheel = Wheel().with_parameters(inertia=FLYWHEEL + mean)
    path = wheel.with_effects([CrankInertia("angle", cosine_2=-mean)]).rollout(
        [0.3, 2.0], np.full((200, 1), 0.4)
    )
    assert path == pytest.approx(truth.T, abs=1e-5)
    assert np.abs(wheel.rollout([0.3, 2.0], np.full((200, 1), 0.4)) - path).max() > 0.1


@pytest.mark.parametrize("field", [f"{kind}_{n}" for kind in ("sine", "cosine") for n in (1, 2, 3)])
def test_nothing_is_lost_on_the_way_round(field):
    effect = CrankInertia("angle", **{field: 0.02})
    path = Wheel(effects=[effect]).rollout([0.3, 8.0], np.zeros((300, 1)))
    energy = (FLYWHEEL + effect.inertia_at(path[:, 0])) * path[:, 1] ** 2
    assert energy == pytest.approx(energy[0], rel=1e-6)
    assert np.ptp(path[:, 1]) > 1.0


def test_a_degree_is_no_radian():
    sizes = {"sine_1": 0.01, "cosine_2": -0.02, "sine_3": 0.003}
    per_degree = {field: np.radians(size) for field, size in sizes.items()}
    torques = np.full((100, 1), 0.3)
    turning = InDegrees(effects=[CrankInertia("angle", **per_degree)])
    assert CrankInertia("angle").quantities(turning)["sine_1"].unit == "N m s^2/deg"
    assert np.radians(turning.rollout(np.degrees([0.3, 5.0]), torques)) == pytest.approx(
        Wheel(effects=[CrankInertia("angle", **sizes)]).rollout([0.3, 5.0], torques), rel=1e-9
    )


def test_rows_have_their_own_and_none_changes_no_bit():
    plain, rng = Wheel(), np.random.default_rng(0)
    states, actions = rng.normal(0, 5, (4, 2)), rng.uniform(-1, 1, (4, 1))
    size = np.array([0.0, 0.01, 0.02, -0.03])
    beside = [CoulombFriction("angle", 0.1)]
    together = plain.with_effects([*beside, CrankInertia("angle", cosine_2=size)]).step(
        states, actions
    )
    for i in range(4):
        own = [*beside, *([CrankInertia("angle", cosine_2=float(size[i]))] if i else [])]
        alone = plain.with_effects(own).step(states[[i]], actions[[i]])
        assert np.array_equal(alone[0], together[i])
    assert "failed" not in repr(check_simulator(Wheel(effects=[CrankInertia("angle", 0.01)])))


class Slide(Wheel):
    state_channels = (
        Channel("place", "m", "position"),
        Channel("speed", "m/s", "rate", rate_of="place"),
    )


class Speed(FirstOrderSystem):
    state_channels = (Channel("speed", "rad/s", "rate"),)
    action_channels = (Channel("torque", "N m", "input", scale=1.0),)

    def derivative(self, x, u, p):
        return u - x


def test_it_is_a_rarer_effect_of_what_turns_and_is_written_out():
    assert "crank_inertia@angle" in map(str, further_in(Wheel()))
    quantity = CrankInertia("angle").quantities(Wheel())["sine_1"]
    assert quantity.unit == "kg m^2" and quantity.scale == pytest.approx(0.2 * FLYWHEEL)
    for other in (Slide(), Speed(), Pendulum()):
        there = (*library(other), *further_in(other))
        assert not [effect for effect in there if isinstance(effect, CrankInertia)]
    with pytest.raises(ValueError, match="'place' slides"):
        Slide(effects=[CrankInertia("place", 0.1)])
    with pytest.raises(ValueError, match="needs a joint of an equation of motion"):
        Speed().with_effects([CrankInertia("speed", 0.1)])
