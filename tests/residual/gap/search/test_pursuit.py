"""Several effects that make one large gap are found around the measured path."""

import numpy as np
import pytest
from held import path

from residual.gap.model.candidates import candidates
from residual.gap.preparation.prepare import prepare
from residual.gap.search.at_sight import at_sight
from residual.gap.search.pursuit import add_pursued
from residual.gap.search.sets import Search
from residual.trajectories import Trajectory
from sims.effects.library import further_in, library
from sims.equations import EquationOfMotion
from sims.simulator import Channel

DT, MASSES = 0.02, np.array([1.2, 0.8])


class Carts(EquationOfMotion):
    """Two carts, each with a motor."""

    dt = DT
    state_channels = (
        Channel("x1", "m", "position", scale=0.3),
        Channel("v1", "m/s", "rate", rate_of="x1", scale=0.5),
        Channel("x2", "m", "position", scale=0.3),
        Channel("v2", "m/s", "rate", rate_of="x2", scale=0.5),
    )
    action_channels = (
        Channel("push1", "N", "input", low=-10.0, high=10.0, scale=3.0),
        Channel("push2", "N", "input", low=-10.0, high=10.0, scale=3.0),
    )

    def acceleration(self, q, v, u, force, p):
        return (u + force) / MASSES


def logs(pull):
    """Three runs under forces that hang on the state, by SciPy, positions alone, with noise."""
    rng, found = np.random.default_rng(77), []
    for run in range(3):
        pushes = np.repeat(rng.uniform(-3, 3, (25, 2)).round(1), 16, axis=0)

        def rates(_, x, u):
            forces = (np.array(u) + pull(x[::2], x[1::2])) / MASSES
            return [x[1], forces[0], x[3], forces[1]]

        states = path(rates, [0.0, 0.0, 0.05, 0.0], tuple(map(tuple, pushes)), DT)
        seen = states + np.array([6e-4, np.nan] * 2) * rng.standard_normal(states.shape)
        found.append(Trajectory(f"run {run}", DT * np.arange(len(seen)), seen, pushes))
    return found


def searched(runs):
    simulator = Carts()
    ready = prepare(simulator, runs, 1.5)
    samples = ready.fitter.samples
    pool = candidates(simulator, library(simulator), samples)
    further = candidates(simulator, further_in(simulator), samples)
    return Search(simulator, pool, ready.fitter), further


def test_springs_of_two_carts_are_fitted_one_after_the_other():
    springs, friction = np.array([-25.0, -12.0]), np.array([-2.0, 0.0])
    search, _ = searched(logs(lambda q, v: springs * q + friction * v))
    added = {frozenset(search.labels(key)): key for key in add_pursued(search)}
    right = added[frozenset({"linear_spring@x1", "linear_spring@x2"})]
    assert search.error(right) < 0.15  # of friction next to nothing is seen beside them
    fitted = search.model(right).bind(search.tried[right].theta).effects
    stiff = {str(effect): effect.stiffness for effect in fitted if effect.name == "linear_spring"}
    assert stiff["linear_spring@x1"] == pytest.approx(25.0, rel=0.1)
    assert stiff["linear_spring@x2"] == pytest.approx(12.0, rel=0.1)


def test_nothing_is_proposed_beside_free_parameters_or_where_nothing_pays():
    search, _ = searched(logs(lambda q, v: 0.0 * q))
    assert add_pursued(search) == []
    search.beside = search.candidates[:1]
    assert add_pursued(search) == []


def test_a_band_between_carts_stands_out_and_is_not_the_librarys():
    def pull(q, v):
        force = -30.0 * (q[0] - q[1])
        return np.array([force, -force])

    search, further = searched(logs(pull))
    standing_out = at_sight(search.measured_path, further)
    assert [one.label for one in standing_out] == ["coupling_spring@x1 and x2"]


@pytest.mark.parametrize("noise", [0.0, 1e-3])
def test_what_the_library_explains_has_nothing_stand_out(noise):
    search, further = searched(logs(lambda q, v: np.array([-25.0, 0.0]) * q - noise * v))
    assert at_sight(search.measured_path, further) == []
