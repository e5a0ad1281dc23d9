"""Exact states of a system that strikes the ground: numbers to the last digits, through impacts."""

import itertools

import numpy as np
import pytest

from residual.gap.model.candidates import candidates
from residual.gap.preparation.prepare import prepare
from residual.gap.search.sets import Search
from residual.trajectories import Trajectory
from sims.effects.library import library
from sims.leo import Leo
from studies.systems.leo import random_poses

EFFECTS = ("torso_mass", "friction")


@pytest.fixture(scope="module")
def search():
    """Short rollouts of the true Leo about its feet's touch-down, and two of its parameters."""
    leo = Leo()
    states, actions = random_poses(np.random.default_rng(5), rollouts=8, steps=8)
    runs = [
        Trajectory(f"run {i}", leo.dt * np.arange(len(path), dtype=float), path, volts)
        for i, (path, volts) in enumerate(zip(states, actions, strict=True))
    ]
    ready = prepare(leo, runs, leo.dt, exact=True)
    offered = [effect for effect in library(leo) if str(effect) in EFFECTS]
    pool = ready.pool(candidates(leo, offered, ready.fitter.samples))
    return Search(leo, pool, ready.fitter, ready.effort, noise=ready.floor.sigma)


@pytest.mark.parametrize("start", [(0.05, 0.01), (0.6, 0.0)])
def test_both_parameters_are_known_to_a_thousandth(search, start):
    search.tried.pop((0, 1), None)
    search.fit((0, 1), np.array(start))
    true, nominal = Leo.true().parameters, Leo().parameters
    for candidate, found in zip(search.candidates, search.tried[0, 1].theta, strict=False):
        name = candidate.effect.where
        wanted = true[name].value - nominal[name].value
        assert found == pytest.approx(wanted, rel=1e-3), name


def test_start_states_stay_as_they_are_known(search):
    data = search.fitter.data
    np.testing.assert_array_equal(search.nominal.inner.fitted.starts, data.guess)
    for start, stop in itertools.islice(data.samples.runs, 3):
        assert stop - start == 9
