"""A horizon that suits what the nominal simulator makes of the log, where the user chose none."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from residual.gap.fitting.forecasts import beside_noise
from residual.gap.fitting.smooth import LEAD
from residual.gap.preparation.horizon import longest_horizon
from residual.gap.preparation.numerics import stride_for
from residual.gap.preparation.prepare import Prepared, prepare
from residual.trajectories import Trajectory
from sims.host import HostSimulator

#: Part of the wanted length that most windows have, below which rows are chosen for theirs.
SHORT = 0.5
#: Error of nominal forecasts over that by noise, from which on it is seen well enough.
SEEN = 3.0


def horizon_of_windows(prepared: Prepared) -> float:
    """How far forecasts usually go, in s: windows end early where motion is unstable."""
    windows, times = prepared.fitter.blocks.windows, prepared.fitter.samples.times
    spans = times[windows.index[:, -1]] - times[windows.index[:, 0]]
    return (1 - LEAD) * float(np.median(spans))


def needs_closer_rows(runs: Sequence[Trajectory], prepared: Prepared) -> bool:
    """Whether most windows are less than half as long as was wanted, and rows far apart for that.

    What is missing may be what keeps motion stable, such as friction of an arm that its motors
    hold up; the few rows of a short window then tell little.
    """
    usual = horizon_of_windows(prepared)
    closer = stride_for(runs, usual) < stride_for(runs, prepared.horizon)
    return usual < SHORT * prepared.horizon and closer


def beyond_noise(
    simulator: HostSimulator, runs: Sequence[Trajectory], prepared: Prepared
) -> Prepared:
    """The same over forecasts twice as long, if those of the nominal simulator hardly err by more
    than noise does: a small push takes time to show.

    No longer, since of a log without a gap errors of the integrator would then be one, where
    motion is unstable: of 27 such logs of a pendulum at three times the usual horizon in 6.
    """
    farther = min(2 * prepared.horizon, longest_horizon(runs))
    if farther <= prepared.horizon:
        return prepared
    if beside_noise(simulator, prepared.fitter, prepared.floor.sigma) > SEEN:
        return prepared
    return prepare(simulator, runs, farther)
