"""One effect in place of several at one joint that make it up together."""

from typing import ClassVar

import numpy as np

from residual.gap.model.candidates import candidates
from residual.gap.preparation.prepare import prepare
from residual.gap.search.for_all import add_one_for_all
from residual.gap.search.sets import Search
from residual.trajectories import Trajectory
from sims.effects.library import library
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter

STIFFNESS, REST, INERTIA, FRICTION = 1.7, 0.35, 0.05, 0.15


class Elbow(EquationOfMotion):
    """A joint that moves by less than a turn."""

    dt = 0.01
    state_channels = (
        Channel("angle", "rad", "position", angle=True),
        Channel("rate", "rad/s", "rate", rate_of="angle", scale=2.0),
    )
    action_channels = (Channel("torque", "N m", "input", scale=2.0, low=-8.0, high=8.0),)
    parameters: ClassVar = {
        "inertia": Parameter(INERTIA, "kg m2", "of the arm", low=0.001),
        "friction": Parameter(FRICTION, "N m s/rad", "viscous", low=0.0, family="dissipation"),
    }

    def acceleration(self, q, v, u, force, p):
        return (u + force - p.friction * v) / p.inertia


def with_a_spring(seed):
    """Torques that a controller holds for a sample, and the angle by small steps."""
    rng = np.random.default_rng(seed)
    angle, rate, goal, rows = 0.3, 0.0, 0.0, []
    for row in range(800):
        goal = rng.uniform(-1.2, 1.2) if row % 60 == 0 else goal
        torque = float(np.clip(6 * (goal - angle) - 0.5 * rate, -8, 8))
        rows.append((angle, rate, torque))
        for _ in range(20):
            pull = torque - FRICTION * rate - STIFFNESS * (angle - REST)
            rate += pull / INERTIA * 5e-4
            angle += rate * 5e-4
    table = np.array(rows)
    states = table[:, :2] + rng.normal(0, [2e-4, 2e-3], (len(table), 2))
    return Trajectory(f"run {seed}", 0.01 * np.arange(len(table)), states, table[:-1, 2:])


def searched(*labels):
    """A search of some effects with a set of all but the last, fitted."""
    simulator = Elbow()
    logs = [with_a_spring(seed) for seed in range(2)]
    fitter = prepare(simulator, logs, 0.6).fitter
    offered = [effect for effect in library(simulator) if str(effect) in labels]
    search = Search(simulator, candidates(simulator, offered, fitter.samples), fitter)
    first: dict[str, int] = {}
    for number, one in enumerate(search.candidates):
        first.setdefault(one.label, number)
    key = tuple(sorted(first[label] for label in labels[:-1]))
    start = [search.candidates[number].trials[0].values[0] for number in key]
    search.add({key: np.concatenate(start)})
    return search, key


def test_an_unbalance_and_a_cogging_that_are_a_spring():
    search, key = searched("unbalance@angle", "cogging@angle", "linear_spring@angle")
    (fresh,) = add_one_for_all(search, key)
    assert search.labels(fresh) == ("linear_spring@angle",)
    np.testing.assert_allclose(search.own(fresh), [STIFFNESS, REST], rtol=0.02)
    assert search.error(fresh) < 0.2 * search.error(key)


def test_what_acts_in_two_places_or_alone_is_left_as_it_is():
    search, key = searched("unbalance@angle", "actuator_gain@torque", "linear_spring@angle")
    assert add_one_for_all(search, key) == []
    alone = tuple(n for n in key if search.candidates[n].label == "unbalance@angle")
    search.add({alone: search.candidates[alone[0]].trials[0].values[0]})
    assert add_one_for_all(search, alone) == []


def test_what_does_less_than_they_do_is_not_tried():
    search, key = searched("unbalance@angle", "cogging@angle", "coulomb_friction@angle")
    assert add_one_for_all(search, key) == []
