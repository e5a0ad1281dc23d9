"""A parameter that is many times its nominal value stands for what has no name."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from residual.gap import find_gap
from residual.gap.answer import confirmed
from residual.gap.answer.confirmed import Answer, untimely, with_stand_ins
from residual.gap.confirmation.claim import Claim
from residual.trajectories import Trajectory
from sims.effects import CoulombFriction, ParameterChange
from sims.equations import FirstOrderSystem
from sims.pendulum_equation import PendulumEquation
from sims.simulator import Channel, Parameter

CLAIM = Claim(0, {}, (), (), (), (), True, True, True, False, (0.9, 0.8, 1.0))
MASS = PendulumEquation().parameters["mass"].value


def answer(times, ratio):
    """A mass so many times as large, and friction, beside so many times the noise."""
    effects = [CoulombFriction("pivot", 0.1), ParameterChange("mass", (times - 1) * MASS)]
    model = SimpleNamespace(
        bind=lambda theta: PendulumEquation().with_effects(effects), added=lambda theta: effects
    )
    search = SimpleNamespace(
        tried={(4, 7): SimpleNamespace(model=model, theta=None)},
        fitter=SimpleNamespace(left=lambda fit, floor: SimpleNamespace(ratio=ratio)),
    )
    found = SimpleNamespace(search=search, adequate=ratio < 1.1, floor=None)
    claims = tuple(dataclasses.replace(CLAIM, number=number) for number in (7, 4))
    return Answer(found, (4, 7), claims, ())


@pytest.mark.parametrize(
    ("times", "ratio", "sure"),
    [(8.0, 9.0, False), (0.2, 9.0, False), (3.0, 9.0, True), (8.0, 2.0, True), (8.0, 1.0, True)],
)
def test_a_parameter_far_off_is_certain_only_where_little_is_left(times, ratio, sure):
    mass, friction = with_stand_ins(answer(times, ratio)).claims
    assert mass.sure is sure and friction.sure


@pytest.mark.parametrize("ratio", [1.0, 9.0, confirmed.FAR])
def test_what_was_not_asked_leaves_nothing_certain_where_much_is_left(ratio):
    sure = [claim.sure for claim in untimely(answer(1.1, ratio)).claims]
    assert sure == [ratio < confirmed.FAR] * 2


class Reactor(FirstOrderSystem):
    """A bioreactor; what its cells make does not harm them."""

    dt = 0.25
    state_channels = (
        Channel("cells", "g/L", "other", scale=5.0),
        Channel("sugar", "g/L", "other", scale=5.0),
    )
    action_channels = (Channel("dilution", "1/h", "input", scale=0.2, low=0.0, high=1.0),)
    parameters = {
        "growth": Parameter(0.4, "1/h", "fastest growth", low=0.0),
        "half": Parameter(1.2, "g/L", "sugar at which cells grow half as fast", low=0.01),
    }

    def derivative(self, x, u, p):
        cells, sugar = x.T
        grown = p.growth * sugar / (p.half + np.maximum(sugar, 0)) * cells
        return np.stack([grown - u[:, 0] * cells, u[:, 0] * (20 - sugar) - 2 * grown], axis=1)


@pytest.mark.long
def test_a_hidden_inhibitor_is_no_certain_half_saturation():
    rng, runs = np.random.default_rng(3), []
    for run in range(4):
        flows = np.repeat(rng.uniform(0.02, 0.3, 16), 20)
        x, path = np.array([rng.uniform(1, 4), rng.uniform(2, 12), 0.0]), []

        def rates(_, x, flow):
            grown = 0.4 * x[1] / (1.2 + x[1]) / (1 + x[2] / 1.5) * x[0]
            made = 0.36 * grown - (flow + 0.05) * x[2]
            return [grown - flow * x[0], flow * (20 - x[1]) - 2 * grown, made]

        for flow in flows:
            path.append(x)
            x = solve_ivp(rates, (0, 0.25), x, rtol=1e-8, atol=1e-10, args=(flow,)).y[:, -1]
        seen = np.array([*path, x])[:, :2] + 0.06 * rng.standard_normal((len(flows) + 1, 2))
        runs.append(Trajectory(f"run {run}", 0.25 * np.arange(len(seen)), seen, flows[:, None]))
    result = find_gap(Reactor(), runs)
    assert not any(v.kind == "confirmed" and v.effect == "half" for v in result.verdicts)
