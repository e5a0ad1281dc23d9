"""Effects on Leo act at the level of forces, against the reference with the same force."""

import functools
import itertools

import leo_reference as reference
import numpy as np
import pytest
from leo_rows import flying, standing, struggling

from sims.effects import (
    Backlash,
    ConstantLoad,
    CoulombFriction,
    Delay,
    LinearSpring,
    QuadraticDrag,
    StribeckFriction,
    ViscousFriction,
    exact_aliases,
)
from sims.leo.simulator import COORDINATES, Leo


@functools.cache
def rows():
    return struggling(Leo(), 15)


def force_on(coordinate, law):
    """A generalized force for the reference."""
    j = COORDINATES.index(coordinate)

    def force(q, v):
        found = np.zeros_like(q)
        found[:, j] = law(q[:, j], v[:, j])
        return found

    return force


SMOOTH = {
    "viscous at a knee": (
        ViscousFriction("left_knee", 0.1),
        force_on("left_knee", lambda q, v: -0.1 * v),
    ),
    "load on an ankle": (
        ConstantLoad("right_ankle", 0.2),
        force_on("right_ankle", lambda q, v: 0.2 + 0 * q),
    ),
    "spring at a hip": (
        LinearSpring("right_hip", 2.0, 0.3),
        force_on("right_hip", lambda q, v: -2.0 * (q - 0.3)),
    ),
    "drag of a knee": (
        QuadraticDrag("right_knee", 0.05),
        force_on("right_knee", lambda q, v: -0.05 * v * np.abs(v)),
    ),
    "drag along": (ViscousFriction("x", 3.0), force_on("x", lambda q, v: -3.0 * v)),
    "lift": (ConstantLoad("z", 4.0), force_on("z", lambda q, v: 4.0 + 0 * q)),
    "push on the pitch": (
        ConstantLoad("pitch", 0.5),
        force_on("pitch", lambda q, v: 0.5 + 0 * q),
    ),
}


@functools.cache
def changed_steps(where):
    """What each effect does to some rows, in the reference: all in one batch."""
    states, actions = flying(15) if where == "in the air" else rows()
    forces = [lambda q, v: np.zeros_like(q), *(force for _, force in SMOOTH.values())]
    n = len(states)

    def force(q, v):
        blocks = [slice(i * n, (i + 1) * n) for i in range(len(forces))]
        return np.concatenate([f(q[b], v[b]) for f, b in zip(forces, blocks, strict=True)])

    many = [np.tile(part, (len(forces), 1)) for part in (states, actions)]
    after = reference.step(*many, reference.System(force=force), h=5e-4).reshape(-1, n, 18)
    return dict(zip(SMOOTH, after[1:] - after[0], strict=True))


@pytest.mark.parametrize("effect", SMOOTH)
@pytest.mark.parametrize("where", ["in the air", "on the ground"])
def test_a_force_does_what_it_does_in_the_reference(effect, where):
    states, actions = flying(15) if where == "in the air" else rows()
    leo = Leo()
    hosting = leo.with_effects([SMOOTH[effect][0]])
    change = hosting.step(states, actions) - leo.step(states, actions)
    wanted = changed_steps(where)[effect]
    left = np.abs(change - wanted)[:, :9].max(axis=1)
    assert np.median(left) < 0.05 * np.median(np.abs(wanted)[:, :9].max(axis=1)) + 2e-5


def test_a_spring_along_x_knows_where_it_is():
    states, actions = (part[:2].copy() for part in rows())
    states[:, 0] = [1.0, -1.0]
    leo = Leo()
    pulled = leo.with_effects([LinearSpring("x", 5.0)]).step(states, actions)
    change = pulled[:, 9] - leo.step(states, actions)[:, 9]
    assert change[0] < 0 < change[1]


@pytest.mark.parametrize("friction", [CoulombFriction, StribeckFriction])
def test_dry_friction_holds_a_joint_and_then_lets_go(friction):
    states, _ = flying(1)
    states[:, 2:] = 0.0
    actions = np.zeros((1, 6))
    actions[0, 2] = 1.0  # 0.29 N m at rest
    size = (0.35,) if friction is CoulombFriction else (0.3, 0.35)
    held = Leo(effects=[friction("left_knee", *size)]).step(states, actions)
    assert abs(held[0, 14]) < 1e-3 and abs(held[0, 5]) < 1e-5
    actions[0, 2] = 3.0
    slipping = Leo(effects=[friction("left_knee", *size)]).step(states, actions)
    assert slipping[0, 14] > 0.1
    assert slipping[0, 14] < Leo().step(states, actions)[0, 14]


def test_dry_friction_of_the_boom_slows_the_torso():
    states, actions = flying(4)
    states[:, 9:12] = 1.0
    actions[:] = 0.0
    free = Leo().step(states, actions)
    # The centre of mass loses what the friction takes: 0.03 s of 2 N on 1.857 kg.
    braked = Leo(effects=[CoulombFriction("x", 2.0)]).step(states, actions)
    moved = _momentum(braked) - _momentum(free)
    np.testing.assert_allclose(moved[:, 0], -0.06, rtol=0.02)
    np.testing.assert_allclose(moved[:, 1], 0, atol=1e-3)


def _momentum(states):
    u = states[:, :9] @ reference.TO_ABSOLUTE.T
    w = states[:, 9:18] @ reference.TO_ABSOLUTE.T
    mass, _ = reference._Body(reference.System(), len(u)).mechanics(u, w)
    return np.einsum("nij,nj->ni", mass, w)[:, :2]


def test_backlash_lets_a_drive_run_across_before_it_pulls():
    leo = Leo(effects=[Backlash("left_knee", 0.2)])
    state, _ = flying(1)
    state[:, 2:] = 0.0
    up, down = np.zeros((1, 6)), np.zeros((1, 6))
    up[0, 2], down[0, 2] = 4.0, -4.0
    states = leo.augment(state, up)
    assert states[0, 18] == pytest.approx(0.1)
    plain = Leo().step(state, up)
    closed = leo.step(states, up)
    np.testing.assert_allclose(closed[:, :9], plain[:, :9], atol=1e-3)
    opened = leo.step(states, down)
    # The free speed is U / K = 2.97 rad/s: 0.089 rad in 0.03 s.
    assert opened[0, 18] == pytest.approx(0.1 - 0.03 * 4 / 1.3447, abs=3e-3)
    passive = np.abs(opened[0, 14])
    assert passive < 0.2 * np.abs(Leo().step(state, down)[0, 14])


def test_nothing_drives_the_torso():
    with pytest.raises(ValueError, match="driven"):
        Leo(effects=[Backlash("pitch", 0.1)])


def test_a_delayed_command_acts_later():
    state, _ = standing()
    leo = Leo(effects=[Delay("left_hip_voltage", 0.015)])
    action = np.zeros((1, 6))
    action[0, 0] = 6.0
    states = leo.augment(state[None])
    late = leo.step(states, action)[0, 12]
    prompt = Leo().step(state[None], action)[0, 12]
    assert 0 < late < prompt


def test_values_per_row_are_those_of_single_rows():
    states, actions = (part[:4] for part in rows())
    sizes = np.array([0.0, 0.05, 0.1, 0.2])
    together = Leo(effects=[ViscousFriction("left_knee", sizes)]).step(states, actions)
    for i, size in enumerate(sizes):
        alone = Leo(effects=[ViscousFriction("left_knee", size)]).step(
            states[i : i + 1], actions[i : i + 1]
        )
        assert np.array_equal(alone[0], together[i])


@pytest.mark.long
def test_only_what_no_walk_could_tell_apart_is_an_alias():
    found = {frozenset(alias.effects) for alias in exact_aliases(Leo())}
    # K / R times the supply and K^2 / R + friction are all that enters.
    motor = ("torque_constant", "resistance", "supply", "friction")
    expected = {frozenset(three) for three in itertools.combinations(motor, 3)}
    expected |= {
        frozenset([f"constant_load@{joint}", f"actuator_bias@{joint}_voltage"])
        for joint in COORDINATES[3:]
    }
    assert found == expected
