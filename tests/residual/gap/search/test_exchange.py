"""Members of a set exchanged for what may do their work."""

from __future__ import annotations

import numpy as np
import pytest

from residual.gap.model.candidates import candidates
from residual.gap.preparation.prepare import prepare
from residual.gap.search.exchange import add_exchanged
from residual.gap.search.redundant import doubles
from residual.gap.search.sets import Search
from residual.trajectories import Trajectory
from sims.effects import CoulombFriction, DirectionalFriction, StribeckFriction
from sims.pendulum_equation import PendulumEquation

EFFECTS = (CoulombFriction("pivot"), DirectionalFriction("pivot"), StribeckFriction("pivot"))
PLAIN, DIRECTIONAL, STRIBECK = (0,), (1,), (2,)


@pytest.fixture(scope="module")
def search() -> Search:
    """Coulomb friction of 0.02 N m, fitted as directional friction."""
    simulator = PendulumEquation()
    rng = np.random.default_rng(0)
    volts = np.repeat(rng.uniform(-3.0, 3.0, (4, 20, 1)), 10, axis=1)
    rubbing = simulator.with_effects([CoulombFriction("pivot", 0.02)])
    path = rubbing.rollout(rng.uniform(-1.0, 1.0, (4, 2)), volts)
    path += np.array([1e-3, 0.02]) * rng.standard_normal(path.shape)
    times = simulator.dt * np.arange(path.shape[1])
    logs = [Trajectory(f"run {i}", times, path[i], volts[i]) for i in range(4)]
    ready = prepare(simulator, logs, 0.4)
    found = Search(simulator, candidates(simulator, EFFECTS, ready.fitter.samples), ready.fitter)
    found.add({DIRECTIONAL: np.array([0.01, 0.01])})
    return found


def test_a_plain_form_begins_from_the_numbers_of_the_law_that_holds_it(search):
    good = search.tried[DIRECTIONAL].merit
    # The plain form was fitted before, and ended in a wrong minimum.
    search.tried[PLAIN] = search.tried[()]
    search.validated[PLAIN] = search.validated[()]
    search.unfit.add(PLAIN)
    search.refused[PLAIN] = "absurd"
    add_exchanged(search, DIRECTIONAL, 0)
    assert search.tried[PLAIN].merit < 1.05 * good
    assert search.own(PLAIN) == pytest.approx([0.02], rel=0.1)
    assert PLAIN in search.usable()
    assert search.error(PLAIN) < 1.1 * search.error(DIRECTIONAL)


def test_a_worse_fit_does_not_replace_a_better_one(search):
    before = search.tried[DIRECTIONAL]
    search.fit(DIRECTIONAL, np.array([10.0, 10.0]))
    assert search.tried[DIRECTIONAL].merit <= before.merit


def test_no_set_holds_a_law_beside_its_special_case(search):
    assert doubles(search, (0, 2))
    add_exchanged(search, PLAIN, 3)
    assert not any(doubles(search, key) for key in search.tried)


def test_what_there_is_no_time_to_try_is_noted(search):
    late = Search(search.simulator, search.candidates, search.fitter, weigh_until=0.0)
    late.add({PLAIN: np.array([0.02])})
    add_exchanged(late, PLAIN, 3)
    assert late.unasked == {(PLAIN, 0)}
    assert set(late.tried) == {(), PLAIN}
