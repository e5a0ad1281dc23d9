"""A model steps a simulator that takes one row at a time as it steps one that takes batches."""

import numpy as np
import pytest

from residual.gap.data.samples import Samples
from residual.gap.model.candidates import candidates
from residual.gap.model.model import Model
from residual.gap.model.workers import AWAY, integrate
from residual.trajectories import Trajectory
from sims.effects import CoulombFriction, Delay, QuadraticDrag, ViscousFriction
from sims.pendulum import Pendulum
from sims.pendulum_equation import PendulumEquation

EFFECTS = (ViscousFriction("pivot"), CoulombFriction("pivot"), Delay("voltage"))


def test_row_by_row_and_in_a_batch_agree():
    rng = np.random.default_rng(0)
    volts = rng.uniform(-3, 3, (12, 1))
    # A pendulum at rest can stick, which takes another path through the simulator.
    states = np.vstack([[np.pi, 0.0], rng.uniform([2, -5], [4, 5], (12, 2))])
    run = Trajectory("run", 0.05 * np.arange(13.0), states, volts)
    samples = Samples.join([run], 20)
    theta = np.array([[0.0, 0.0, 0.0], [1e-4, 3e-4, 0.0], [0.0, 1e-3, 0.02]])
    after = []
    for simulator in (Pendulum(), PendulumEquation()):
        model = Model(simulator, candidates(simulator, EFFECTS, samples))
        after.append(model.advance(samples, np.stack([states] * 3), theta))
    np.testing.assert_allclose(after[0], after[1], atol=2e-3)
    assert np.abs(after[0][1] - after[0][0]).max() > 0.05


def test_a_row_that_runs_away_costs_only_itself():
    simulator = Pendulum().with_effects([QuadraticDrag("pivot", np.array([0.0, 1e6, 0.0]))])
    states = np.array([[3.0, 5.0], [3.0, 5.0], [3.0, 5.0]])
    after = integrate(simulator, states, np.zeros((3, 10, 1)), np.full(3, 0.05))
    plain = Pendulum().step(states[:1], np.zeros((1, 1)))
    np.testing.assert_allclose(after[[0, 2]], np.repeat(plain, 2, axis=0), atol=1e-3)
    assert np.isfinite(after).all()
    assert np.abs(after[1]).max() == pytest.approx(AWAY)
