"""A corrected simulator that is worse than the nominal one from the readings themselves."""

import dataclasses

import numpy as np
import pytest
from held import path

import residual.gap.inquiry as inquiry
from residual.gap import find_gap
from residual.gap.answer.from_readings import not_kept, worse_from_readings
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter


class Body(FirstOrderSystem):
    """A heated body."""

    dt = 1.0
    state_channels = (Channel("temp", "K", "other", scale=10.0),)
    action_channels = (Channel("power", "W", "input", scale=10.0),)
    parameters = {"heat": Parameter(20.0, "J/K", "capacity", low=0.1)}

    def derivative(self, x, u, p):
        return u / np.reshape(p.heat, (-1, 1))


def cooled(seed, n=300):
    """The same that loses heat."""
    rng = np.random.default_rng(seed)
    power = np.repeat(rng.uniform(0, 20, n // 20), 20)
    seen = path(lambda _, x, u: [u / 20.0 - 0.05 * x[0]], [3.0], power, 1.0)[:-1]
    seen = seen + 0.02 * rng.standard_normal(seen.shape)
    return Trajectory(f"run {seed}", np.arange(float(n)), seen, power[:-1, None])


@pytest.fixture
def answer(monkeypatch):
    known = []
    monkeypatch.setattr(inquiry, "worse_from_readings", lambda one: known.append(one))
    find_gap(Body(), [cooled(seed) for seed in range(2)])
    return known[0]


def test_what_is_right_is_kept(answer):
    assert answer.key and worse_from_readings(answer) is None


def test_what_errs_more_from_there_is_not_kept(answer):
    search = answer.found.search
    fit = search.tried[answer.key]
    search.tried[answer.key] = dataclasses.replace(fit, theta=-0.2 * np.abs(fit.theta) - 0.02)
    times = worse_from_readings(answer)
    assert times > 1.2
    left, says = not_kept(answer, times)
    assert left.key == () and left.claims == ()
    assert set(search.labels(answer.key)) <= set(left.leads) and f"{times:.2g} times" in says
