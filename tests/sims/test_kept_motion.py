"""What is kept of a system from one step to the next."""

import copy
import dataclasses

import numpy as np

from sims.effects import ViscousFriction
from sims.pendulum_equation import PendulumEquation


def test_what_is_kept_of_a_system_between_steps_is_never_of_another_one():
    states, inputs = np.array([[1.0, 2.0]]), np.array([[1.0]])
    plain = PendulumEquation()
    own = plain.step(states, inputs)
    other = copy.copy(plain)
    other.inertia_follows_mass, other.parameters = True, {**plain.parameters}
    assert np.array_equal(other.step(states, inputs), own)  # the mass is the idealised one
    other.parameters["mass"] = dataclasses.replace(other.parameters["mass"], value=0.09)
    heavier = PendulumEquation(0.09, inertia_follows_mass=True).step(states, inputs)
    for _ in range(2):
        assert np.array_equal(other.step(states, inputs), heavier)
        assert np.array_equal(plain.step(states, inputs), own)
    braked = plain.with_effects([ViscousFriction("pivot", 1e-3)])
    assert not np.array_equal(braked.step(states, inputs), own)
    assert np.array_equal(plain.step(states, inputs), own)
