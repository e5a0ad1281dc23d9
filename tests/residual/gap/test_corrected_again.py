"""A simulator that was corrected by what remembers is asked about again, as any other."""

import numpy as np
import pytest
from plate import Plate

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.effects import Backlash, ConstantLoad, FlexiblePart, SecondStore
from sims.pendulum_equation import PendulumEquation

CORRECTED = {
    "store": (Plate().with_effects([SecondStore("warmth", 0.01, 100.0)]), 0.0, 1.0, 0.05),
    "play": (PendulumEquation().with_effects([Backlash("pivot", 0.1)]), -2.0, 2.0, 0.003),
    "part": (PendulumEquation().with_effects([FlexiblePart("pivot", 0.3, 4.0)]), -2.0, 2.0, 0.003),
}  # fmt: skip


def log_of(simulator, low, high, noise, load=0.0):
    """One record of it, with more than it says."""
    rng = np.random.default_rng(1)
    where = simulator.joints[0].name
    true = simulator.with_effects([*simulator.effects, ConstantLoad(where, load)])
    actions = np.repeat(rng.uniform(low, high, 20), 20)[:, None]
    own = len(simulator.physical_channels)
    states = true.rollout(np.zeros(len(true.state_channels)), actions)[:, :own]
    states = states + noise * rng.standard_normal(states.shape)
    return Trajectory("run", simulator.dt * np.arange(len(states)), states, actions)


@pytest.mark.parametrize("kind", CORRECTED)
def test_what_it_remembers_is_no_gap(kind):
    simulator, *drive = CORRECTED[kind]
    result = find_gap(simulator, log_of(simulator, *drive), effects=["constant_load"])
    assert [v.kind for v in result.verdicts if v.kind not in ("needs_data", "minor")] == ["no_gap"]


@pytest.mark.parametrize(("kind", "load"), [
    ("store", 0.5), pytest.param("play", 0.02, marks=pytest.mark.long),
])  # fmt: skip
def test_what_else_is_missing_is_named(kind, load):
    simulator, *drive = CORRECTED[kind]
    log = log_of(simulator, *drive, load=load)
    (named,) = [v for v in find_gap(simulator, log, effects=["constant_load"]).verdicts if v.effect]
    assert named.kind == "confirmed"
    assert named.parameters["load"].value == pytest.approx(load, rel=0.1)
