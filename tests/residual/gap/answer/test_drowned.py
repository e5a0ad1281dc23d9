"""Where noise hides all that moves, nothing is told of a gap, not that there is none."""

import numpy as np
import pytest

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.pendulum_equation import PendulumEquation
from studies.gap.lead import lead


@pytest.mark.parametrize(
    ("noise", "kind"), [(3.0, "unexplained"), pytest.param(0.02, "no_gap", marks=pytest.mark.long)]
)
def test_noise_as_large_as_the_motion_is_told(noise, kind):
    pendulum, rng = PendulumEquation(), np.random.default_rng(0)
    inputs = np.repeat(rng.uniform(-1.0, 1.0, (40, 1)), 10, axis=0)
    states = pendulum.rollout(np.array([0.3, 0.0]), inputs)[:, :1]
    seen = np.full((len(states), 2), np.nan)
    seen[:, :1] = states + rng.normal(0, noise * states.std(), states.shape)
    run = Trajectory("run", pendulum.dt * np.arange(len(seen)), seen, inputs)
    found = find_gap(pendulum, [run])
    kinds = [verdict.kind for verdict in found.verdicts if verdict.kind != "needs_data"]
    assert kinds == [kind] and found.gap.drowned == (kind == "unexplained")
    assert lead(found).startswith("Noise hides") == found.gap.drowned
