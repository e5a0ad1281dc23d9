"""Three things that are wrong at once, of which no two take anything off."""

from typing import ClassVar

import numpy as np
import pytest
from held import path

from residual.gap import find_gap
from residual.gap.model.candidates import candidates
from residual.gap.preparation.prepare import prepare
from residual.gap.search.beam import grow, three_at_once
from residual.gap.search.exchange import add_pairs_exchanged
from residual.gap.search.sets import Search
from residual.trajectories import Trajectory
from sims.chosen import chosen_effects
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter

DT, UPPER, LOWER, INFLOW = 5.0, 0.046, 0.045, 0.022


class Tanks(FirstOrderSystem):
    """One tank empties into another; both outflows are taken too small, an inflow is forgotten."""

    dt = DT
    state_channels = (
        Channel("upper", "V", "other", scale=3.0),
        Channel("lower", "V", "other", scale=3.0),
    )
    action_channels = (Channel("pump", "V", "input", scale=1.0, low=0.0, high=5.0),)
    parameters: ClassVar = {
        "pumping": Parameter(0.05, "1/s", "of the pump", low=0.001),
        "upper_hole": Parameter(0.03, "V^0.5/s", "outflow of the upper tank", low=0.001),
        "lower_hole": Parameter(0.03, "V^0.5/s", "outflow of the lower tank", low=0.001),
    }

    def derivative(self, x, u, p):
        a, b = np.sqrt(np.maximum(x[:, 0], 0.0)), np.sqrt(np.maximum(x[:, 1], 0.0))
        out = p.upper_hole * a
        return np.stack([p.pumping * u[:, 0] - out, out - p.lower_hole * b], axis=1)


def levels(seed):
    """Random steps of the pump, by SciPy, with noise; the lower tank leaks a bit."""
    rng = np.random.default_rng(seed)
    pump = np.repeat(rng.uniform(0.6, 3.0, 30), 7)

    def rate(t, x, u):
        out = UPPER * np.sqrt(max(x[0], 0.0))
        leak = 0.0015 * x[1]  # What no simulator has all of.
        return [0.05 * u + INFLOW - out, out - LOWER * np.sqrt(max(x[1], 0.0)) - leak + 0.002]

    states = path(rate, [2.0, 2.0], pump, DT)
    seen = states + rng.normal(0, 0.004, states.shape)
    return Trajectory(f"run {seed}", DT * np.arange(len(seen)), seen, pump[:, None])


#: The three, and what may be taken for them.
OFFERED = (
    "constant_load", "proportional_loss", "sensor_scale", "sensor_offset", "actuator_gain",
    "upper_hole", "lower_hole",
)  # fmt: skip


def cut(log, row):
    """One record as two."""
    first, second = slice(0, row + 1), slice(row, None)
    parts = (first, slice(0, row)), (second, slice(row, None))
    return [
        Trajectory(f"{log.name}, {n}", log.times[a], log.states[a], log.actions[b])
        for n, (a, b) in enumerate(parts)
    ]


@pytest.mark.long
@pytest.mark.parametrize("row", [None, 90], ids=["one record", "cut in two"])
def test_three_that_help_only_together_are_found(row):
    log = levels(0)
    found = find_gap(Tanks(), cut(log, row) if row else [log], effects=OFFERED)
    sizes = {str(effect): effect for effect in found.effects}
    assert {"upper_hole", "lower_hole"} <= set(sizes)
    assert "constant_load@upper" in sizes
    assert 0.03 + sizes["upper_hole"].change == pytest.approx(UPPER, rel=0.15)
    assert found.gap.share.value > 0.9


@pytest.fixture
def offered():
    """A search in which all three are candidates among others, and the three."""
    simulator, names = Tanks(), ("constant_load@upper", "upper_hole", "lower_hole")
    ready = prepare(simulator, [levels(0)], 100.0)
    pool = candidates(simulator, chosen_effects(simulator, OFFERED), ready.fitter.samples)
    places = {candidate.label: number for number, candidate in enumerate(pool)}
    return Search(simulator, pool, ready.fitter), places, tuple(sorted(places[n] for n in names))


def test_two_of_a_wrong_set_are_exchanged_at_once(offered):
    search, places, right = offered
    wrong = ("proportional_loss@upper", "sensor_scale@lower", "upper_hole")
    key = tuple(sorted(places[name] for name in wrong))
    start = np.concatenate([0.0 * search.candidates[n].trials[0].values[0] for n in key])
    search.add({key: start})
    assert right not in search.tried
    add_pairs_exchanged(search, key)
    assert search.tried[right].merit < 0.5 * search.tried[key].merit


def test_a_search_that_ends_at_two_tries_three_at_once(offered):
    search, _, right = offered
    grow(search, ())
    two = min(fit.merit for fit in search.tried.values())
    assert right not in search.tried
    three_at_once(search)
    assert search.tried[right].merit < 0.5 * two
