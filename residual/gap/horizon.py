"""How far forecasts go if the user does not say: far enough to see, short enough to repeat."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from residual.gap.smooth import LEAD
from residual.trajectories import Trajectory
from sims.host import HostSimulator

#: Spread of an angle that turns and turns.
TURNING = np.pi / np.sqrt(3)
#: Part of the usual period of the motion.
PART = 1 / 3
#: Windows that the records should at least be good for.
WINDOWS = 8
#: Least samples of a window.
SAMPLES = 8


def usual_horizon(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> float:
    """A third of the usual period of the motion, or less if the records are short, in s.

    The period is that of a sine with the same spread and the same spread of its rate, the middle
    one over channels. At least the records have to hold ``WINDOWS`` windows of ``SAMPLES`` samples.

    Args:
        simulator: Gives the channels and the control period.
        trajectories: Measured runs.
    """
    if simulator.has_contacts:
        # After a few strikes of the ground no forecast of a walk means anything.
        return 10 * simulator.dt
    total = sum(float(t.times[-1] - t.times[0]) for t in trajectories)
    longest = max(float(t.times[-1] - t.times[0]) for t in trajectories)
    step = float(np.median(np.concatenate([t.durations for t in trajectories])))
    periods = []
    for column, channel in enumerate(simulator.physical_channels):
        if channel.kind == "rate" and any(
            np.isfinite(t.states[:, i]).any()
            for t in trajectories
            for i, other in enumerate(simulator.physical_channels)
            if other.name == channel.rate_of
        ):
            continue
        period = _period(trajectories, column, channel.angle)
        if np.isfinite(period):
            periods.append(period)
    wanted = PART * float(np.median(periods)) if periods else 20 * simulator.dt
    most = (1 - LEAD) * min(total / WINDOWS, longest)
    return float(max(min(wanted, most), (1 - LEAD) * SAMPLES * step))


def _period(trajectories: Sequence[Trajectory], column: int, angle: bool) -> float:
    """Of a sine that moves as far and as fast as a channel, NaN if it stands still."""
    spread, speed, count = 0.0, 0.0, 0
    most = TURNING if angle else np.inf
    for run in trajectories:
        values, times = run.states[:, column], run.times
        known = np.isfinite(values)
        if known.sum() < 8:
            continue
        values, times = values[known], times[known]
        # Differences over several samples: noise must not pass for speed.
        lag = max(1, len(values) // 60)
        rates = (values[lag:] - values[:-lag]) / (times[lag:] - times[:-lag])
        spread += len(values) * min(float(values.std()), most) ** 2
        speed += float((rates**2).mean()) * len(values)
        count += len(values)
    if not count or speed <= 0 or spread <= 0:
        return float("nan")
    return 2 * np.pi * float(np.sqrt(spread / speed))
