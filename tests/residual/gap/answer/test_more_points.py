"""A parameter that follows a channel is asked for through more points where three leave much."""

from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest
from held import path

from residual.gap import find_gap
from residual.gap.answer.varying import through_more_points
from residual.gap.model.candidates import candidates
from residual.gap.preparation.prepare import prepare
from residual.gap.search.redundant import curves_in_place, doubles
from residual.gap.search.sets import Search
from residual.trajectories import Trajectory
from sims.effects import ParameterCurve, ParameterSpline
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter

DT = 0.02


class Slide(EquationOfMotion):
    """A cart on an oiled slide way."""

    dt = DT
    state_channels = (
        Channel("x", "m", "position", scale=0.3),
        Channel("v", "m/s", "rate", rate_of="x", scale=0.5),
    )
    action_channels = (Channel("push", "N", "input", scale=10.0, low=-30.0, high=30.0),)
    parameters: ClassVar = {
        "mass": Parameter(3.0, "kg", "cart", low=0.1),
        "damping": Parameter(11.0, "N s/m", "oil", low=0.0, family="dissipation"),
    }

    def acceleration(self, q, v, u, force, p):
        return ((u[:, 0] + force[:, 0] - p.damping * v[:, 0]) / p.mass)[:, None]


def worn(x):
    """Damping of the way, which is dry in the middle of one half."""
    return 11.0 + 24.0 * np.exp(-(((x - 0.12) / 0.2) ** 2))


def moved(_, x, push):
    return [x[1], (push - worn(x[0]) * x[1]) / 3.0]


def record(seed, rows=700):
    """The cart goes to and fro over all of the way."""
    rng = np.random.default_rng(seed)
    phase = rng.uniform(0, 6)
    aim = 0.45 * np.sin(0.9 * DT * np.arange(rows) + phase)
    push, state, states = [], np.array([aim[0], 0.0]), []
    for k in range(rows):
        states.append(state)
        force = np.clip(90.0 * (aim[k] - state[0]) + rng.normal(0, 3.0), -30, 30)
        push.append(force)
        state = path(moved, state, [force], DT)[-1]
    seen = np.array(states) + rng.standard_normal((rows, 2)) * [2e-4, 1e-3]
    return Trajectory(f"run {seed}", DT * np.arange(rows), seen, np.array(push)[:-1, None])


@pytest.mark.long
def test_a_worn_place_wants_more_than_a_parabola():
    result = find_gap(Slide(), [record(seed) for seed in (1, 2, 3)])
    (curve,) = [effect for effect in result.effects if isinstance(effect, ParameterCurve)]
    assert str(curve) == "parameter_spline@damping over x"
    places = np.linspace(-0.4, 0.4, 33)
    assert np.abs(11.0 + curve.at(places) - worn(places)).max() < 4.0
    assert result.gap.share.value > 0.98
    names = {verdict.label for verdict in result.verdicts if verdict.kind == "confirmed"}
    assert names <= {str(curve)}


def asked(adequate):
    named = ParameterCurve("damping", "x", low=-0.4, high=0.5)
    pool = [SimpleNamespace(effect=named)]
    left = SimpleNamespace(adequate=adequate)
    search = SimpleNamespace(candidates=pool)
    return SimpleNamespace(found=SimpleNamespace(search=search), key=(0,), left=left)


def test_it_is_asked_over_the_same_channel_where_something_is_left():
    assert through_more_points(asked(True)) == []
    (spline,) = through_more_points(asked(False))
    assert (str(spline), spline.reach) == ("parameter_spline@damping over x", (-0.4, 0.5))
    again = SimpleNamespace(effect=spline)
    answer = asked(False)
    answer.found.search.candidates = [again]
    assert through_more_points(answer) == []


def test_it_takes_the_place_of_what_has_three_points_and_starts_from_its_shape():
    simulator = Slide()
    fitter = prepare(simulator, [record(1)], 1.0).fitter
    curve = ParameterCurve("damping", "x", low=-0.5, high=0.5)
    spline = ParameterSpline("damping", "x", low=-0.5, high=0.5)
    search = Search(simulator, candidates(simulator, [curve, spline], fitter.samples), fitter)
    assert doubles(search, (0, 1))
    search.fit((0,), np.array([10.0, 30.0, 10.0]))
    first, second, third = search.tried[(0,)].theta
    start = curves_in_place(search, [(0,)])[(1,)]
    halves = [(3 * first + 6 * second - third) / 8, (3 * third + 6 * second - first) / 8]
    np.testing.assert_allclose(start, [first, halves[0], second, halves[1], third], rtol=1e-9)
