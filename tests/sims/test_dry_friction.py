"""Dry friction holds what it holds, and takes energy otherwise."""

import math

import numpy as np
import pytest
from hosts import HOSTS, host, rows
from pendulum_reference import INERTIA, LENGTH, G

from sims.effects import (
    CoulombFriction,
    DirectionalFriction,
    QuadraticDrag,
    StribeckFriction,
    ViscousFriction,
)


@host
@pytest.mark.parametrize(
    "friction", [CoulombFriction("pivot", 4e-3), StribeckFriction("pivot", 1e-3, 4e-3, 0.5)]
)
def test_what_friction_holds_does_not_creep(host, friction):
    simulator = HOSTS[host].with_effects([friction])
    # 0.1 rad off hanging: gravity pulls with 2.3e-3 N m, less than the friction holds.
    start = np.array([np.pi - 0.1, 0.0])
    path = simulator.rollout(start, np.zeros((200, 1)))
    assert np.array_equal(path, np.tile(start, (201, 1)))
    # A voltage that pulls harder than friction and gravity together moves it.
    assert simulator.rollout(start, np.full((2, 1), 3.0))[-1, 1] != 0


@host
def test_friction_that_differs_by_direction_holds_one_way_and_slips_the_other(host):
    # 0.1 rad off hanging, gravity pulls back with 2.3e-3 N m.
    start = np.array([[np.pi - 0.1, 0.0], [np.pi + 0.1, 0.0]])
    for levels, held in (((3e-3, 1e-3), 0), ((1e-3, 3e-3), 1), ((3e-3, 3e-3), 2)):
        simulator = HOSTS[host].with_effects([DirectionalFriction("pivot", *levels)])
        stays = (simulator.step(start, np.zeros((2, 1))) == start).all(axis=1)
        assert np.array_equal(stays, {0: [True, False], 1: [False, True], 2: [True, True]}[held])


@host
def test_a_swing_with_dry_friction_comes_to_rest_in_finite_time(host):
    simulator = HOSTS[host].with_effects([CoulombFriction("pivot", 2e-3)])
    path = simulator.rollout([np.pi - 1.5, 0.0], np.zeros((60, 1)))
    assert path[-1, 1] == 0.0 and path[-1, 0] == path[-2, 0]
    assert abs(0.055 * G * LENGTH * math.sin(path[-1, 0])) <= 2e-3


def test_dissipation_takes_energy():
    states, _ = rows(20, seed=5)
    actions = np.zeros((20, 1))

    def energy(states):
        potential = 0.055 * G * LENGTH * np.cos(states[:, 0])
        return 0.5 * INERTIA * states[:, 1] ** 2 + potential

    nominal = energy(HOSTS["equation"].step(states, actions))
    for effect in (
        ViscousFriction("pivot", 1e-4),
        QuadraticDrag("pivot", 1e-5),
        CoulombFriction("pivot", 1e-4),
        StribeckFriction("pivot", 1e-4, 2e-4, 0.5),
    ):
        simulator = HOSTS["equation"].with_effects([effect])
        assert (energy(simulator.step(states, actions)) < nominal + 1e-9).all()
