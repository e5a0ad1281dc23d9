"""A command that goes one way only: what hangs on it and what hangs on time look alike."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from residual.logs.checks import Finding
from residual.trajectories import Trajectory
from sims.host import HostSimulator

#: Distinct values of a sweep at least, and part of its range that it goes back by, or at once.
LEVELS, BACK, STEP = 8, 0.02, 0.3


def sweeps(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> list[Finding]:
    """Inputs that only rise, or only fall, in a single record, and not by a few steps.

    Every value comes once then, at a time of its own: no block of the record tells what the command
    does in another one, and a dead zone, a delay and a drift may take each other's place.
    """
    if len(trajectories) != 1:
        return []
    found = []
    (run,) = trajectories
    for channel, values in zip(simulator.action_channels, run.actions.T, strict=True):
        span = float(np.ptp(values))
        if len(np.unique(values)) < LEVELS or np.abs(np.diff(values)).max() > STEP * span:
            continue
        for way, rising in (("rises", values), ("falls", -values)):
            if (np.maximum.accumulate(rising) - rising).max() <= BACK * span:
                says = (
                    f"only {way} in the one record: what it does by its value (a dead zone, a "
                    "curve) and by time (a delay, a drift) look alike, and no part of the record "
                    "tells of another; sweep both ways, or twice"
                )
                found.append(Finding("sweep", channel.name, says, {"range": span}, "warning"))
    return found
