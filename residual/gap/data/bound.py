"""Positions that are bound to each other, as in a closed chain, where a log lacks one of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from residual.gap.data.inspection import measured
from residual.gap.data.samples import unseen
from residual.logs.checks import Finding
from residual.trajectories import Trajectory
from sims.host import HostSimulator


def bound(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> list[Finding]:
    """Positions that were not logged, and that others that were leave no choice."""
    if simulator.bonds is None:
        return []
    channels = simulator.physical_channels
    logged = [channels.index(channel) for channel, _ in measured(simulator, trajectories)]
    states = np.nan_to_num(np.concatenate([run.states[:, : len(channels)] for run in trajectories]))
    told = simulator.bonds.told(states, unseen(channels, logged))
    return [
        Finding(
            "bound",
            channel.name,
            f"was not logged, and is worked out from the others: {simulator.name} binds them to "
            "each other (<equality>)",
        )
        for channel, known in zip(channels, told, strict=True)
        if known and channel.kind != "rate"
    ]
