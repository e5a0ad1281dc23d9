"""Inputs at rest, and inputs that are on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.trajectories import Trajectory
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: Part of an input's largest reading from rest below which it rests.
STILL = 0.05


def rest(simulator: HostSimulator) -> Array:
    """Inputs that do nothing, as far as their bounds allow, (n_a,)."""
    channels = simulator.action_channels
    return np.array([np.clip(0.0, channel.low, channel.high) for channel in channels])


def largest(simulator: HostSimulator, runs: Sequence[Trajectory]) -> Array:
    """How far every input goes from rest, (n_a,)."""
    return np.max([np.abs(run.actions - rest(simulator)).max(axis=0) for run in runs], axis=0)


def begins_on(simulator: HostSimulator, runs: Sequence[Trajectory]) -> list[bool]:
    """Of every run, whether an input is on as it begins."""
    if not runs:
        return []
    least, off = STILL * largest(simulator, runs), rest(simulator)
    return [bool((np.abs(run.actions[0] - off) > least).any()) for run in runs]
