"""A valve that overlaps by more on one side: a dead zone and a bias, which is then no load."""

from typing import ClassVar

import numpy as np
import pytest

from residual.gap import find_gap
from residual.gap.model.candidates import candidates
from residual.gap.preparation.prepare import prepare
from residual.gap.search.parted import parted
from residual.gap.search.sets import Search
from residual.trajectories import Trajectory
from sims.chosen import chosen_effects
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter

DT, PACE, LAG, OPENS, BACK = 0.01, 0.10, 0.048, 0.49, 0.81
#: What was confirmed in place of what is missing, and that.
FRICTION = ("directional_friction", "coulomb_friction")
OFFERED = (*FRICTION, "dead_zone", "actuator_bias", "constant_load", "lag")


class Cylinder(EquationOfMotion):
    """A hydraulic cylinder behind a proportional valve, slower to answer than it is."""

    dt = DT
    state_channels = (
        Channel("stroke", "m", "position", scale=0.2),
        Channel("speed", "m/s", "rate", rate_of="stroke", scale=0.5),
    )
    action_channels = (Channel("valve", "V", "input", low=-10.0, high=10.0),)
    parameters: ClassVar = {"lag": Parameter(0.06, "s", "of its speed", low=1e-3)}

    def acceleration(self, q, v, u, force, p):
        return ((PACE * u[:, 0] - v[:, 0]) / p.lag + force[:, 0])[:, None]


def log(rows=2500):
    """Under a position controller; every command is held for a sample, so that steps are exact."""
    rng, stroke, speed, seen, valves = np.random.default_rng(7), 0.0, 0.0, [], []
    for now in DT * np.arange(rows):
        wanted = 0.12 * np.sin(0.69 * now) + 0.06 * np.sin(1.95 * now + 0.7)
        wanted += 0.02 * np.sin(5.65 * now)
        valve = 25 * (wanted - stroke)
        opened = max(valve - OPENS, 0.0) + min(valve + BACK, 0.0)
        seen.append((stroke, np.nan))
        valves.append(valve)
        end, kept = PACE * opened, np.exp(-DT / LAG)
        stroke += end * DT + (speed - end) * LAG * (1 - kept)
        speed = end + (speed - end) * kept
    states = np.array(seen) + rng.normal(0, 1e-4, (rows, 1))
    return Trajectory("run", DT * np.arange(rows), states, np.array(valves)[:-1, None])


@pytest.fixture(scope="module")
def found():
    return find_gap(Cylinder(), [log()], effects=OFFERED)


@pytest.mark.long
def test_it_is_no_friction_by_direction(found):
    certain = {v.effect: v for v in found.verdicts if v.kind == "confirmed"}
    assert {"dead_zone", "actuator_bias"} <= set(certain) <= {"dead_zone", "actuator_bias", "lag"}
    (width,) = certain["dead_zone"].parameters.values()
    (bias,) = certain["actuator_bias"].parameters.values()
    assert width.value == pytest.approx((OPENS + BACK) / 2, rel=0.01)
    assert bias.value == pytest.approx((BACK - OPENS) / 2, rel=0.02)
    assert found.gap.after.value < 1.1 * found.gap.noise_floor.value


@pytest.mark.long
def test_a_load_is_told_from_a_bias_behind_the_dead_zone(found):
    (bias,) = (verdict for verdict in found.verdicts if verdict.effect == "actuator_bias")
    assert "constant_load@stroke" not in bias.same_motion


@pytest.fixture(scope="module")
def search():
    """The first part of the log, with a load as the exact twin of a bias."""
    simulator, run = Cylinder(), log(800)
    ready = prepare(simulator, [run], 1.0)
    samples = ready.fitter.samples
    offered = chosen_effects(simulator, ("dead_zone", "actuator_bias", "lag"))
    (load,) = candidates(simulator, chosen_effects(simulator, ("constant_load",)), samples)
    return Search(
        simulator, candidates(simulator, offered, samples), ready.fitter,
        twins={"actuator_bias@valve": [load]},
    )  # fmt: skip


@pytest.mark.parametrize(
    ("names", "apart"),
    [(("dead_zone@valve", "actuator_bias@valve"), True), (("actuator_bias@valve", "lag"), False)],
)
def test_a_load_is_a_bias_but_behind_a_dead_zone(search, names, apart):
    labels = [candidate.label for candidate in search.candidates]
    key = tuple(sorted(map(labels.index, names)))
    start = {"dead_zone@valve": [0.6], "actuator_bias@valve": [0.15], "lag": [-0.01]}
    search.add({key: np.concatenate([start[labels[number]] for number in key])})
    told = [(labels[number], twin.label) for number, twin in parted(search, key)]
    assert told == ([("actuator_bias@valve", "constant_load@stroke")] if apart else [])
