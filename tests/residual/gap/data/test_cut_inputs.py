"""An input that was cut off where it was recorded is told; one that a controller bounds is not."""

import dataclasses

import numpy as np
import pytest

from residual.gap.data.cut_inputs import cut_inputs
from residual.trajectories import Trajectory
from sims.equations import EquationOfMotion
from sims.simulator import Channel


def slider(low=-np.inf, high=np.inf):
    class Slider(EquationOfMotion):
        dt = 0.02
        state_channels = (
            Channel("place", "m", "position"),
            Channel("speed", "m/s", "rate", rate_of="place"),
        )
        action_channels = (Channel("force", "N", "input", low=low, high=high),)
        parameters = {}

        def acceleration(self, q, v, u, force, p):
            return u + force

    return Slider()


def runs(shape, seed=0, count=3, rows=400):
    rng, found = np.random.default_rng(seed), []
    for k in range(count):
        force = shape(rng, rows)
        states = np.zeros((rows + 1, 2))
        found.append(Trajectory(f"run {k}", 0.02 * np.arange(rows + 1), states, force[:, None]))
    return found


def levels(rng, rows):
    """Held levels that are drawn anew every twenty rows."""
    return np.repeat(rng.uniform(-1.4, 1.4, rows // 20), 20)


def waves(rng, rows):
    """Sines that no two rows share a value of."""
    t = 0.02 * np.arange(rows)
    return sum(np.sin(rng.uniform(2, 9) * t + rng.uniform(0, 6)) for _ in range(3))


def few(rng, rows):
    return np.repeat(rng.choice([-1.0, -0.5, 0.0, 0.5, 1.0], rows // 20), 20)


def grid(rng, rows):
    """A hand on a lever that reads in steps of a tenth."""
    return np.round(10 * np.clip(waves(rng, rows) / 3, -1, 1)) / 10


@pytest.mark.parametrize("shape", [levels, waves])
@pytest.mark.parametrize("seed", range(3))
def test_what_was_cut_off_is_told(shape, seed):
    cut = [
        dataclasses.replace(run, actions=np.clip(run.actions, -0.6, 0.6))
        for run in runs(shape, seed)
    ]
    (found,) = cut_inputs(slider(), cut)
    assert (found.kind, found.where, found.severity) == ("cut", "force", "warning")
    assert "0.6 N" in found.says
    at = sum(int((np.abs(run.actions) == 0.6).sum()) for run in cut)
    assert 0.8 * at <= found.numbers["samples"] <= at
    # A bound that the simulator declares is the actuator's.
    assert cut_inputs(slider(-0.6, 0.6), cut) == []


@pytest.mark.parametrize("shape", [levels, waves, few, grid])
@pytest.mark.parametrize("seed", range(3))
def test_what_was_not_is_not(shape, seed):
    assert cut_inputs(slider(), runs(shape, seed)) == []


def test_a_drive_that_rests_is_not_cut_off():
    off = [dataclasses.replace(run, actions=np.maximum(run.actions, 0.0)) for run in runs(levels)]
    assert cut_inputs(slider(), off) == []
