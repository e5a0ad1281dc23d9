"""A part of the mass on a spring: against two masses by an independent integrator."""

from typing import ClassVar

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sims.checks import check_simulator
from sims.effects import CoulombFriction, FlexibleJoint, FlexiblePart
from sims.effects.library import parts_in
from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.simulator import Channel, Parameter

FIRST, SECOND, STIFF, DAMPER, DRAG = 2.0, 0.5, 400.0, 3.0, 1.5
# Of both against each other: the reduced mass on the spring.
REDUCED = FIRST * SECOND / (FIRST + SECOND)
SWING = np.sqrt(STIFF / REDUCED)
PART = {
    "ratio": SECOND / FIRST,
    "frequency": SWING / (2 * np.pi),
    "damping": DAMPER / (2 * REDUCED * SWING),
}


class Sled(EquationOfMotion):
    dt = 0.01
    state_channels = (
        Channel("place", "m", "position", scale=0.5),
        Channel("speed", "m/s", "rate", rate_of="place", scale=1.0),
    )
    action_channels = (Channel("push", "N", "input", scale=20.0),)
    parameters: ClassVar = {"mass": Parameter(FIRST + SECOND, "kg", "of all", low=0.01)}

    def acceleration(self, q, v, u, force, p):
        return ((u[:, 0] - DRAG * v[:, 0] + force[:, 0]) / p.mass)[:, None]


class Spindle(FirstOrderSystem):
    dt = 0.01
    state_channels = (Channel("speed", "rad/s", "rate", scale=1.0),)
    action_channels = (Channel("torque", "N m", "input", scale=20.0),)
    parameters: ClassVar = {"inertia": Parameter(FIRST + SECOND, "kg m^2", "of all", low=0.01)}

    def derivative(self, x, u, p):
        return ((u[:, 0] - DRAG * x[:, 0]) / p.inertia)[:, None]


def two_masses(push, rows, dry=0.0):
    """Place and speed of the first of two masses on a spring, (rows + 1, 2)."""

    def rates(t, x):
        force = STIFF * (x[2] - x[0]) + DAMPER * (x[3] - x[1])
        # Dry friction of a first mass that never stands still here.
        pulled = push + force - DRAG * x[1] - dry * np.sign(x[1])
        return [x[1], pulled / FIRST, x[3], -force / SECOND]

    times = 0.01 * np.arange(rows + 1)
    found = solve_ivp(rates, (0, times[-1]), [0, 1, 0, 1], t_eval=times, rtol=1e-10, atol=1e-12)
    return found.y[:2].T


@pytest.mark.parametrize("dry", [0.0, 2.0])
def test_it_moves_like_two_masses_on_a_spring(dry):
    effects = [FlexiblePart("place", **PART)] + ([CoulombFriction("place", dry)] if dry else [])
    sled = Sled(effects=effects)
    assert [c.name for c in sled.state_channels][2:] == ["place part", "place part rate"]
    path = sled.rollout(sled.augment([[0.0, 1.0]])[0], np.full((100, 1), 20.0))
    truth = two_masses(20.0, 100, dry)
    assert path[:, :2] == pytest.approx(truth, abs=1e-6)
    alone = Sled().rollout([0.0, 1.0], np.full((100, 1), 20.0))
    assert np.abs(alone - truth).max() > 0.03


def test_a_speed_carries_one_too():
    spindle = Spindle(effects=[FlexiblePart("speed", **PART)])
    assert [(c.name, c.unit) for c in spindle.state_channels][1:] == [
        ("speed part", "rad"), ("speed part rate", "rad/s"),
    ]  # fmt: skip
    path = spindle.rollout(spindle.augment([[1.0]])[0], np.full((100, 1), 20.0))
    assert path[:, 0] == pytest.approx(two_masses(20.0, 100)[:, 1], abs=1e-6)


def test_friction_holds_the_first_mass_while_the_part_swings_and_dies_away():
    sled = Sled(effects=[FlexiblePart("place", **PART), CoulombFriction("place", 50.0)])
    start = np.array([0.3, 0.0, 0.05, 0.0])  # the spring pulls with 20 N
    path = sled.rollout(start, np.zeros((300, 1)))
    assert (path[:, 0] == 0.3).all() and (path[:, 1] == 0.0).all()
    # Held, it is the second mass on the spring.
    swing = np.sqrt(STIFF / SECOND)
    ratio = DAMPER / (2 * SECOND * swing)
    fast = swing * np.sqrt(1 - ratio**2)
    t = 0.01 * np.arange(301)
    closed = np.cos(fast * t) + ratio * swing / fast * np.sin(fast * t)
    assert path[:, 2] == pytest.approx(0.05 * np.exp(-ratio * swing * t) * closed, abs=1e-6)


@pytest.mark.parametrize("kind", [Sled, Spindle])
def test_rows_have_parts_of_their_own_and_none_changes_no_bit(kind):
    plain, rng = kind(), np.random.default_rng(0)
    joint = plain.joints[0].name
    width = len(plain.state_channels)
    states, actions = rng.normal(0, 1, (4, width + 2)), rng.uniform(-20, 20, (4, 1))
    ratio, frequency = np.array([0.0, 0.1, 1.0, 9.0]), np.array([1.0, 3.0, 5.0, 0.5])
    together = plain.with_effects([FlexiblePart(joint, ratio, frequency)]).step(states, actions)
    for i in range(1, 4):
        alone = plain.with_effects([FlexiblePart(joint, float(ratio[i]), float(frequency[i]))])
        assert np.array_equal(alone.step(states[[i]], actions[[i]])[0], together[i])
    assert np.array_equal(together[:1, :width], plain.step(states[:1, :width], actions[:1]))
    corrected = plain.with_effects([FlexiblePart(joint, 0.2, 4.0)])
    assert "failed" not in repr(check_simulator(corrected))


class Arm(EquationOfMotion):
    dt = 0.01
    state_channels = (
        Channel("angle", "rad", "position", scale=1.0),
        Channel("rate", "rad/s", "rate", rate_of="angle", scale=3.0),
    )
    action_channels = (Channel("torque", "N m", "input", scale=20.0),)

    def acceleration(self, q, v, u, force, p):
        total = u[:, 0] - DRAG * v[:, 0] - 40.0 * np.sin(q[:, 0]) + force[:, 0]
        return (total / (FIRST + SECOND))[:, None]


@pytest.mark.parametrize("at_the_part", [0.0, SECOND / (FIRST + SECOND), 1.0])
def test_gravity_pulls_at_the_part_in_proportion_or_at_the_part_alone(at_the_part):
    def rates(t, x):
        force = STIFF * (x[2] - x[0]) + DAMPER * (x[3] - x[1])
        first = 20.0 + force - DRAG * x[1] - (1 - at_the_part) * 40.0 * np.sin(x[0])
        second = -force - at_the_part * 40.0 * np.sin(x[2])
        return [x[1], first / FIRST, x[3], second / SECOND]

    times = 0.01 * np.arange(101)
    truth = solve_ivp(rates, (0, 1), [0, 1, 0, 1], t_eval=times, rtol=1e-10, atol=1e-12).y[:2].T
    errors = []
    for kind in (FlexiblePart, FlexibleJoint):
        arm = Arm(effects=[kind("angle", **PART)])
        path = arm.rollout(arm.augment([[0.0, 1.0]])[0], np.full((100, 1), 20.0))
        errors.append(np.abs(path[:, :2] - truth).max())
    right = [abs(at_the_part - SECOND / (FIRST + SECOND)) < 1e-9, at_the_part == 1.0]
    assert [error < 1e-6 for error in errors] == right


def test_a_joint_is_offered_where_something_pulls_by_position():
    named = [[str(part) for part in parts_in(one)] for one in (Arm(), Sled(), Spindle())]
    assert named == [
        ["flexible_part@angle", "flexible_joint@angle"], ["flexible_part@place"],
        ["flexible_part@speed"],
    ]  # fmt: skip


def test_what_does_not_move_has_none():
    class Room(FirstOrderSystem):
        state_channels = (Channel("air", "degC", "other", scale=50.0),)
        action_channels = (Channel("power", "W", "input", scale=500.0),)

        def derivative(self, x, u, p):
            return (u - 5.0 * x) / 800.0

    with pytest.raises(ValueError, match="'air' is none"):
        Room(effects=[FlexiblePart("air", 0.2)])
