"""Sensors that are read less often than rows come, each reading repeated until the next.

A slow bus, or topics that were joined by time and filled downwards, make stairs of a smooth motion:
late by up to a step, and rough. Only the first row of every step is a reading.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from residual.logs.checks import Finding
from residual.logs.faults import grain
from residual.trajectories import Trajectory
from sims.host import HostSimulator

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Changes that show a rhythm, and part of them that may follow the one before at once.
ENOUGH, AT_ONCE = 20, 0.02
#: Times the usual number of rows between changes that most of them are apart, at least and at most.
EARLY, LATE = 0.5, 1.5
#: Steps of rounding that changes are larger than, or rounding alone makes a slow motion a stair.
ROUGH = 3.0


def without_repeats(
    simulator: HostSimulator, trajectories: Sequence[Trajectory]
) -> tuple[list[Trajectory], list[Finding]]:
    """The runs with repeats of slow sensors as missing, and what was found.

    Args:
        simulator: Gives the channels.
        trajectories: Measured runs.
    """
    runs = [np.array(run.states, float) for run in trajectories]
    found = []
    for column, channel in enumerate(simulator.physical_channels):
        values = [states[:, column] for states in runs]
        usual = rhythm(values)
        if not usual:
            continue
        gone = 0
        for own in values:
            stale = ~fresh(own, usual) & np.isfinite(own)
            own[stale] = np.nan
            gone += int(stale.sum())
        step = float(np.median(np.concatenate([run.durations for run in trajectories])))
        says = (
            f"was read every {usual * step:.3g} s or so, and is repeated in the rows between: "
            f"{gone} repeats were taken as missing"
        )
        numbers = {"every_s": usual * step, "samples": gone}
        found.append(Finding("repeats", channel.name, says, numbers, "warning"))
    if not found:
        return list(trajectories), []
    return [replace(run, states=s) for run, s in zip(trajectories, runs, strict=True)], found


def rhythm(values: Sequence[Array]) -> int:
    """Rows from one reading to the next, 0 if every row may be one.

    Args:
        values: A channel in every run, (n,).
    """
    rows = [np.flatnonzero(np.diff(own) != 0) for own in values]
    apart = np.concatenate([np.diff(own) for own in rows] or [np.zeros(0, int)])
    if len(apart) < ENOUGH:
        return 0
    usual = float(np.median(apart))
    least, most = np.quantile(apart, [0.1, 0.75])
    if (apart == 1).mean() > AT_ONCE or least < EARLY * usual or most > LATE * usual:
        return 0
    jumps = np.concatenate([np.abs(np.diff(own))[at] for own, at in zip(values, rows, strict=True)])
    return round(usual) if np.nanmedian(jumps) > ROUGH * grain(values) else 0


def fresh(values: Array, usual: int) -> Mask:
    """Rows that hold a new reading, (n,): a change, or as many rows after the last one.

    Args:
        values: A channel, (n,).
        usual: Rows from one reading to the next.
    """
    found = np.append(True, np.diff(values) != 0)
    last = 0
    for row in range(len(values)):
        if found[row] or row - last >= LATE * usual:
            found[row], last = True, row
    return found
