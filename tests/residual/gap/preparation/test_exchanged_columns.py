"""Logs in which two columns stand in each other's place."""

from __future__ import annotations

import dataclasses
from typing import ClassVar

import numpy as np
import pytest
from hanging import Crane

from residual.gap.preparation.conventions import otherwise
from residual.gap.preparation.prepare import prepare
from residual.trajectories import Trajectory
from sims.effects import ActuatorGain, ActuatorLag, ConstantLoad, CoulombFriction, Delay
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter

HEATERS = ("left heater", "right heater")


class Plates(FirstOrderSystem):
    """Two plates that warm each other, each with a heater; the right one is the heavier."""

    dt = 2.0
    state_channels = (
        Channel("left", "degC", "other", scale=10.0),
        Channel("right", "degC", "other", scale=10.0),
    )
    action_channels = tuple(
        Channel(n, "W", "input", scale=5.0, low=0.0, high=10.0) for n in HEATERS
    )
    parameters: ClassVar = {
        "capacity": Parameter(20.0, "J/K", "heat that warms the left plate by 1 K"),
        "loss": Parameter(0.1, "W/K", "loss to the room, each"),
        "between": Parameter(0.2, "W/K", "conductance between the plates"),
    }

    def derivative(self, x, u, p):
        flow = p.between * (x[:, 0] - x[:, 1])
        left = (u[:, 0] - p.loss * (x[:, 0] - 20.0) - flow) / p.capacity
        right = (u[:, 1] - p.loss * (x[:, 1] - 20.0) + flow) / (3.0 * p.capacity)
        return np.stack([left, right], axis=1)


def log(effects):
    rng = np.random.default_rng(0)
    watts = np.repeat(rng.uniform(0.0, 10.0, (1, 30, 2)), 20, axis=1)
    plates = Plates(effects=effects)
    warm = plates.rollout(plates.augment(np.array([[20.0, 20.0]])), watts)[0, :, :2]
    return Trajectory(
        "plates", 2.0 * np.arange(len(warm)), warm + 0.05 * rng.standard_normal(warm.shape),
        watts[0],
    )  # fmt: skip


def changes(run):
    found = otherwise(Plates(), prepare(Plates(), [run], 60.0).fitter)
    return () if found is None else found.changes


@pytest.mark.parametrize("effects", [
    (), pytest.param((ActuatorGain("left heater", -0.2),), marks=pytest.mark.long),
    (ActuatorLag("right heater", 15.0),),
    pytest.param((ConstantLoad("left", 0.1),), marks=pytest.mark.long),
])  # fmt: skip
def test_exchanged_columns_are_told_and_honest_ones_not(effects):
    run = log(effects)
    assert not changes(run)
    assert changes(dataclasses.replace(run, states=run.states[:, ::-1])) == (
        "the columns of left and of right exchanged (`column:` for each)",
    )
    assert changes(dataclasses.replace(run, actions=run.actions[:, ::-1])) == (
        "the columns of left heater and of right heater exchanged (`column:` for each)",
    )


@pytest.mark.parametrize(
    "effects", [(), (CoulombFriction("trolley", 4.0),), (Delay("force", 0.1),)]
)
def test_columns_of_other_units_may_be_exchanged_too(effects):
    rng, crane = np.random.default_rng(0), Crane(effects=effects)
    force = np.repeat(rng.uniform(-20.0, 20.0, (1, 20, 1)), 15, axis=1)
    seen = crane.rollout(crane.augment(np.zeros((1, 4))), force)[0, :, :4]
    seen += rng.normal(0, 2e-3, seen.shape)
    seen[:, [1, 3]] = np.nan
    times = 0.05 * np.arange(len(seen))
    for order, said in (
        ([0, 1, 2, 3], ()),
        ([2, 3, 0, 1], ("the columns of trolley and of swing exchanged (`column:` for each)",)),
    ):
        run = Trajectory("crane", times, seen[:, order], force[0])
        found = otherwise(Crane(), prepare(Crane(), [run], 2.0).fitter)
        assert (found.changes if found else ()) == said
