"""What friction holds breaks away where an input jumps, also between rows of a thinned log."""

import dataclasses

import numpy as np
import pytest

from residual.gap import find_gap
from residual.gap.data.samples import Samples
from residual.gap.model.model import Model
from residual.gap.preparation.numerics import enough_substeps
from residual.trajectories import Trajectory
from sims.effects import CoulombFriction
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter

DT, LEVEL, STRIDE, SIGMA = 0.01, 0.8, 4, np.array([0.05, 2.0])


class Stage(EquationOfMotion):
    """A linear stage in mm that a force in N pushes."""

    dt = DT
    state_channels = (
        Channel("x", "mm", "position"),
        Channel("speed", "mm/s", "rate", rate_of="x"),
    )
    action_channels = (Channel("force", "N", "input", low=-20.0, high=20.0),)
    parameters = {"mass": Parameter(2.0, "kg", "mass", low=0.1)}

    def acceleration(self, q, v, u, force, p):
        return (1000.0 * (u + force - 0.008 * v)) / np.reshape(p.mass, (-1, 1))


def record(seed, rows=600, hold=25):
    """Levels of force, some of which move nothing from rest; it begins at rest."""
    rng = np.random.default_rng(seed)
    force = np.repeat(rng.uniform(-12, 12, rows // hold), hold)
    force[:hold] = 0.3
    states = Stage(substeps=50, effects=[CoulombFriction("x", LEVEL)]).rollout(
        np.zeros(2), force[:, None]
    )
    return Trajectory(f"run {seed}", DT * np.arange(rows + 1), states, force[:, None])


def test_thinned_rows_are_followed_through_a_jump_from_rest():
    run = record(1)
    samples = Samples.join([run], 2, STRIDE)
    stage = Stage(effects=[CoulombFriction("x", LEVEL)])
    nodes = run.states[::STRIDE][: len(samples)]
    count = enough_substeps(stage, samples, nodes, SIGMA, 40)
    fine = dataclasses.replace(samples, substeps=count)
    path = Model(stage).roll(fine, np.zeros(1, int), np.zeros((1, 2)), 24, np.zeros(0))[0]
    np.testing.assert_allclose(path, run.states[: 25 * STRIDE : STRIDE], atol=1e-3)
    # Without friction fewer do.
    assert enough_substeps(Stage(), samples, nodes, SIGMA, 40) < count


@pytest.mark.long
def test_its_friction_is_all_that_is_found():
    """One jump from rest that was half a row late left 0.7 % without a name."""
    runs = []
    for seed in (0, 1):
        run = record(seed)
        noise = SIGMA * np.random.default_rng(seed).standard_normal(run.states.shape)
        runs.append(dataclasses.replace(run, states=run.states + noise))
    offered = ("mass", "coulomb_friction", "viscous_friction")
    found = find_gap(Stage(), runs, effects=offered)
    (named,) = [v for v in found.verdicts if v.kind != "needs_data"]
    assert (named.kind, named.effect) == ("confirmed", "coulomb_friction")
    level = named.parameters["level"]
    assert level.low <= LEVEL <= level.high and level.value == pytest.approx(LEVEL, rel=0.005)
