"""Where a controller with one goal makes every input, laws in proportion to it are not certain."""

from typing import ClassVar

import numpy as np
import pytest

from residual.gap import find_gap
from residual.gap.confirmation.feedback import fed_back
from residual.gap.data.samples import Samples
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter

DT = 0.05


class Motor(FirstOrderSystem):
    dt = DT
    state_channels = (Channel("speed", "rad/s", "rate", scale=50.0),)
    action_channels = (Channel("voltage", "V", "input", scale=5.0, low=-12.0, high=12.0),)
    parameters: ClassVar = {"tau": Parameter(0.4, "s", "time constant", low=0.01)}

    def derivative(self, x, u, p):
        return (10.0 * u - x) / np.reshape(p.tau, (-1, 1))


def run(goals, late=0, seed=0):
    """A motor that somebody pulls at, kept near its goals by a controller that is cut off."""
    rng, speed, seen, given = np.random.default_rng(seed), 0.0, [], []
    for goal in goals:
        read = speed + 0.3 * rng.standard_normal()
        seen.append(read)
        given.append(np.clip(0.15 * (goal - seen[max(len(seen) - 1 - late, 0)]), 0.0, 9.0))
        speed += (10.0 * given[-1] - 12.0 - speed) * (1 - np.exp(-DT / 0.4))
        speed += 0.3 * rng.standard_normal()
    return Trajectory(
        f"run {seed}", DT * np.arange(len(seen)), np.array(seen)[:, None],
        np.array(given)[:-1, None],
    )  # fmt: skip


ONE = np.full(400, 80.0)
SEVERAL = np.repeat([80.0, 40.0, 100.0, 60.0, 30.0, 90.0, 50.0, 70.0], 50)


@pytest.mark.parametrize(
    ("goals", "late", "told"), [(ONE, 0, True), (ONE, 1, True), (SEVERAL, 0, False)]
)
def test_a_law_of_the_readings_is_seen_and_goals_that_change_are(goals, late, told):
    assert fed_back(Samples.join([run(goals, late)], 1)) is told


def test_records_of_one_goal_each_change_it_together():
    runs = [run(np.full(200, goal), seed=int(goal)) for goal in (50.0, 80.0)]
    assert fed_back(Samples.join(runs[:1], 1)) and not fed_back(Samples.join(runs, 1))


@pytest.mark.long
def test_without_inputs_of_its_own_a_load_is_not_certain():
    for goals, alone in ((ONE, False), (SEVERAL, True)):
        found = find_gap(Motor(), [run(goals)])
        pushes = ("constant_load", "actuator_bias", "sensor_offset")
        (load,) = (v for v in found.verdicts if v.effect in pushes and v.parameters)
        assert ("loop" in load.doubts) == (not alone)
