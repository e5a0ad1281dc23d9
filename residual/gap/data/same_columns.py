"""Two states that read the same in every row: one column was read for both."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from residual.gap.data.inspection import measured, refusal
from residual.logs.checks import Finding
from residual.trajectories import Trajectory
from sims.host import HostSimulator

#: Different values from which on two sensors do not read the same by chance.
ENOUGH = 20


def same_columns(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> list[Finding]:
    """A refusal of every two measured states that are one, row by row."""
    found = []
    names = [channel.name for channel in simulator.physical_channels]
    logged = [names.index(channel.name) for channel, _ in measured(simulator, trajectories)]
    states = np.concatenate([run.states for run in trajectories])
    for one, other in itertools.combinations(logged, 2):
        both = states[:, [one, other]]
        both = both[np.isfinite(both).all(axis=1)]
        if len(np.unique(both[:, 0])) >= ENOUGH and (both[:, 0] == both[:, 1]).all():
            says = (
                f"reads the same as {names[one]!r} in all {len(both)} rows, so one column was "
                "written or read for both; say under states which column is which, or leave out "
                "what was not measured"
            )
            found.append(refusal("copied", names[other], says))
    return found
