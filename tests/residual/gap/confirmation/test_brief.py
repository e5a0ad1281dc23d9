"""Times too short for a log's own clock are not certain."""

from types import SimpleNamespace

import numpy as np
import pytest

from residual.gap.confirmation.certainty import brief
from residual.gap.data.samples import Samples
from residual.gap.model.candidates import candidates
from residual.trajectories import Trajectory
from sims.effects import ActuatorLag, Delay
from sims.pendulum_equation import PendulumEquation


@pytest.mark.parametrize(
    ("effect", "hold", "samples", "found"),
    [
        (Delay, "zero", 0.4, True), (Delay, "zero", 0.6, False), (ActuatorLag, "linear", 0.6, True),
        (Delay, "linear", 0.9, False),
    ],
)  # fmt: skip
def test_a_line_half_a_sample_late_may_be_a_step(effect, hold, samples, found):
    simulator = PendulumEquation().with_hold({"voltage": hold})
    run = Trajectory("run", 0.05 * np.arange(50), np.zeros((50, 2)), np.ones((49, 1)))
    table = Samples.join([run], 4)
    tried = candidates(simulator, [effect("voltage")], table)
    search = SimpleNamespace(
        candidates=tried, fitter=SimpleNamespace(samples=table), simulator=simulator
    )
    assert brief(search, 0, np.array([samples * 0.05])) is found
