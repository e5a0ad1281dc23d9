"""A sensor at the end of its range: nothing is missing in the simulator."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest
from held import path

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter

AREA, HOLE, DT, END = 2.0, 0.08, 10.0, 0.6


class Tank(FirstOrderSystem):
    """A level by its inflow and a hole."""

    dt = DT
    state_channels = (Channel("level", "m", "other", scale=0.5),)
    action_channels = (Channel("inflow", "m^3/s", "input", low=0.0, scale=0.05),)
    parameters: ClassVar = {
        "area": Parameter(AREA, "m^2", "tank", low=0.1),
        "hole": Parameter(HOLE, "m^2.5/s", "outflow by the root of the level", low=0.001),
    }

    def derivative(self, x, u, p):
        flow = u[:, 0] - p.hole * np.sqrt(np.maximum(x[:, 0], 0.0))
        return (flow / p.area)[:, None]


def log(seed, most=0.07, gain=1.0):
    rng = np.random.default_rng(seed)
    inflow = np.repeat(rng.uniform(0.03, most, 30), 25)

    def rates(_, x, u):
        return [(gain * u - HOLE * np.sqrt(max(x[0], 0.0))) / AREA]

    states = path(rates, [0.4], inflow, DT, max_step=20.0)
    seen = states + 0.002 * rng.standard_normal(states.shape)
    return Trajectory("tank", DT * np.arange(len(seen)), seen, inflow[:, None])


def cut(run):
    return Trajectory(run.name, run.times, np.minimum(run.states, END), run.actions)


def test_a_level_that_stays_at_the_end_of_the_sensor_names_nothing():
    found = find_gap(Tank(), [cut(log(76))])
    assert not [one for one in found.verdicts if one.kind == "confirmed"]
    (says,) = [one.says for one in found.quality if "the end of all its values" in one.says]
    there = int((log(76).states >= END).sum())
    assert f"level stays at 0.6 m, the end of all its values, in {there} of 751 samples" in says


def test_what_is_missing_elsewhere_is_found_all_the_same():
    found = find_gap(Tank(), [cut(log(77, gain=0.85))])
    (sure,) = [one for one in found.verdicts if one.kind == "confirmed"]
    assert {sure.label, *sure.alternatives} >= {"actuator_gain@inflow"}
    assert sure.parameters["gain"].value == pytest.approx(-0.15, abs=0.02)


def test_a_log_without_such_stays_is_left_alone():
    found = find_gap(Tank(), [log(78, gain=0.85)])
    assert not [one.says for one in found.quality if "the end of all its values" in one.says]
