"""Times too short for a log's own clock are not certain."""

from types import SimpleNamespace

import numpy as np
import pytest

from residual.gap.confirmation.timing import untimed
from residual.gap.data.samples import Samples
from residual.gap.model.candidates import candidates
from residual.trajectories import Trajectory
from sims.effects import ActuatorLag, Delay
from sims.pendulum_equation import PendulumEquation


@pytest.mark.parametrize(
    ("effect", "hold", "samples", "changes", "found"),
    [
        (Delay, "zero", 0.4, True, True), (Delay, "zero", 0.6, True, False),
        (ActuatorLag, "linear", 0.6, True, True), (Delay, "linear", 0.9, True, False),
        (Delay, "zero", 5.0, False, True), (ActuatorLag, "zero", 5.0, False, False),
    ],
)  # fmt: skip
def test_a_time_is_told_by_what_the_log_resolves(effect, hold, samples, changes, found):
    """A line half a sample late may be a step, and what never changes may have come on later."""
    simulator = PendulumEquation().with_hold({"voltage": hold})
    inputs = np.ones((49, 1))
    inputs[20:] += changes
    run = Trajectory("run", 0.05 * np.arange(50), np.zeros((50, 2)), inputs)
    table = Samples.join([run], 4)
    tried = candidates(simulator, [effect("voltage")], table)
    search = SimpleNamespace(
        candidates=tried, fitter=SimpleNamespace(samples=table), simulator=simulator
    )
    assert untimed(search, 0, np.array([samples * 0.05])) is found
