"""The walking task: reward, falls, starts, and the measures of a walk."""

import leo_reference as reference
import numpy as np
import pytest
from leo_rows import WALK, flying

from sims.leo import Leo
from sims.leo.body import centre_of_mass, clearance
from sims.leo.walking import Walking, electrical_work, measure_walk

K, R = 0.006325081 * 212.6, 4.6


def test_the_centre_of_mass_is_where_potential_energy_has_it():
    states, _ = flying(10)
    states[:, 9:] = 0.0
    for slope, column in ((0.0, 1), (np.pi / 2, 0)):
        system = reference.System(slope=slope)
        mass = 0.94226 + 0.095 + 2 * (0.19978 + 0.13691 + 0.07319)
        where = reference.energy(states, system) / (9.81 * mass)
        np.testing.assert_allclose(centre_of_mass(states[:, :9])[:, column], where, atol=1e-12)


def test_clearance_is_that_of_the_reference():
    states, _ = flying(10)
    np.testing.assert_allclose(clearance(states[:, :9]), reference.gaps(states), atol=1e-12)


def test_the_reward_of_a_step_by_hand():
    states = np.zeros((1, 18))
    states[0, 5:7] = -0.1
    following = states.copy()
    following[0, 0] = 0.02
    following[0, 12] = 2.0
    actions = np.array([[5.0, -2.0, 0, 0, 0, 0]])
    # The left hip turns at a mean of 1 rad/s against 5 V, the right one stands against -2 V.
    work = 0.03 * (5 * (5 - K) / R + 4 / R)
    assert electrical_work(states, actions, following)[0] == pytest.approx(work)
    expected = 300 * 0.02 - 1.5 - 2 * work
    assert Walking().reward(states, actions, following)[0] == pytest.approx(expected)
    following[0, 2] = 1.1
    ahead = centre_of_mass(following[:, :9])[0, 0] - centre_of_mass(states[:, :9])[0, 0]
    expected = 300 * ahead - 1.5 - 2 * work - 75
    assert Walking().reward(states, actions, following)[0] == pytest.approx(expected)


def test_a_motor_that_is_driven_gives_nothing_back():
    states = np.zeros((1, 18))
    states[0, 12] = 6.0
    actions = np.array([[5.0, 0, 0, 0, 0, 0]])
    assert electrical_work(states, actions, states)[0] == 0.0


@pytest.mark.parametrize(
    "column, value, fallen",
    [
        (2, 0.99, False),
        (2, -1.01, True),
        (1, -0.149, False),
        (1, -0.151, True),
        (7, 1.13, False),
        (8, -1.14, True),
        (5, 0.001, True),
        (6, -0.001, False),
    ],
)
def test_falls(column, value, fallen):
    state = np.zeros((1, 18))
    state[0, 5:7] = -0.1
    state[0, column] = value
    assert Walking().terminal(state)[0] == fallen
    knee = column in (5, 6)
    assert Walking(knees="free").terminal(state)[0] == (fallen and not knee)


def test_it_starts_on_the_left_leg_with_the_lowest_wheel_on_the_ground():
    task = Walking()
    start = task.start(np.random.default_rng(0))
    assert np.array_equal(start, task.start(np.random.default_rng(1)))
    assert start[4] == 0.82 and start[6] == -1.27 and not start[9:].any()
    assert reference.gaps(start[None]).min() == pytest.approx(0, abs=1e-12)
    assert not task.terminal(start[None])[0]


def test_starts_around_the_pose_differ_by_five_degrees_at_most_and_are_no_falls():
    task = Walking(start_at="around")
    rng = np.random.default_rng(0)
    starts = np.array([task.start(rng) for _ in range(300)])
    pose = Walking().start(rng)
    reach = np.deg2rad(5)
    away = np.abs(starts[:, 3:9] - pose[3:9])
    assert away.max() <= reach + 1e-12 and (away.max(axis=0) > 0.9 * reach).all()
    assert starts[:, 5:7].max() <= -0.02
    np.testing.assert_allclose(reference.gaps(starts).min(axis=1), 0, atol=1e-12)
    assert not task.terminal(starts).any()


def test_a_walk_is_measured_to_its_fall():
    leo, task = Leo(), Walking(knees="free")
    actions = np.full((60, 6), -1.0)
    states = leo.rollout(task.start(np.random.default_rng(0)), actions)
    walk = measure_walk(states, actions, task)
    steps = int(task.terminal(states[1:]).argmax()) + 1
    assert walk.fell and walk.time == pytest.approx(0.03 * steps)
    assert walk.distance == pytest.approx(states[steps, 0] - states[0, 0])
    rewards = task.reward(states[:-1], actions, states[1:])[:steps]
    assert walk.score == pytest.approx(rewards.sum())
    # Without the gear in K next to no back-EMF is left: U^2 / R.
    assert walk.work_without_gear == pytest.approx(0.03 * steps * 6 / R, rel=0.05)


@pytest.mark.parametrize(("leo", "share"), [(Leo(), 0.068), (Leo.true(), 0.051)])
def test_what_the_papers_formula_would_give_back(leo, share):
    # The figures of docs/deviations.md: motors hardly brake, and never with the bare constant.
    rows = np.load(WALK)
    states, actions = rows["s"], rows["a"]
    after = leo.step(states, actions)
    rates = 0.5 * (states[:, 12:18] + after[:, 12:18])
    for constant, back in ((K, share), (K / 212.6, 0.0)):
        signed = 0.03 * (actions * (actions - constant * rates) / R).sum()
        counted = electrical_work(states, actions, after, constant=constant).sum()
        assert 1 - signed / counted == pytest.approx(back, abs=1e-3)


def test_a_walk_may_lead_nowhere():
    actions = np.zeros((2, 6))
    walk = measure_walk(np.zeros((3, 18)), actions, Walking(knees="free"))
    assert walk.distance == 0 and not walk.fell and walk.time == pytest.approx(0.06)
