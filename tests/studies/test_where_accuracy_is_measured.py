"""Along which states a difference model is judged: all that the policy visits, or the first."""

import dataclasses

import numpy as np
import pytest

from policy import Algorithm
from residual.corrected import CorrectedSimulator
from residual.difference import DifferenceModel
from residual.linear import Linear
from residual.trajectories import Transitions
from sims.pendulum_equation import PendulumEquation
from sims.protocol import EvaluationProtocol
from sims.system import System
from sims.tasks import SwingUp
from studies.learning import measuring
from studies.learning.measuring import where_it_goes


class Drive:
    """A policy that pushes with half of what it can."""

    def act(self, observation):
        return np.full(1, 1.5)


def corrected():
    nominal, true = PendulumEquation(), PendulumEquation.true()
    rng = np.random.default_rng(0)
    states = rng.uniform([-3, -8], [3, 8], (60, 2))
    actions = rng.uniform(-3, 3, (60, 1))
    data = Transitions(states, actions, true.step(states, actions), np.arange(60))
    return CorrectedSimulator(nominal, DifferenceModel(Linear(), nominal).fit(data))


@pytest.mark.parametrize(
    ("protocol", "steps", "stride"),
    [
        (EvaluationProtocol(), 300, 2),
        (EvaluationProtocol(visited_seconds=2.0), 40, 1),
        (EvaluationProtocol(visited_seconds=2.0, visited_stride=7), 40, 7),
        (EvaluationProtocol(visited_rollouts=2), 300, 1),
    ],
)
def test_rollouts_are_judged_over_as_much_as_the_protocol_says(
    monkeypatch, protocol, steps, stride
):
    system = System(
        "long", PendulumEquation(), PendulumEquation.true(), SwingUp(horizon=300), protocol
    )
    seen = {}
    real = measuring.accuracy_along

    def told(model, states, actions, **given):
        seen.update(given, lengths={len(one) for one in actions}, rollouts=len(actions))
        return real(model, states, actions, **given)

    monkeypatch.setattr(measuring, "accuracy_along", told)
    found, taken = where_it_goes(system, Algorithm(), Drive(), corrected(), 0)
    assert taken == steps * protocol.visited_rollouts
    assert seen == {
        "stride": stride, "lengths": {steps}, "rollouts": protocol.visited_rollouts
    }  # fmt: skip
    assert all(np.isfinite(list(dataclasses.asdict(found)["one_step"].values())))
