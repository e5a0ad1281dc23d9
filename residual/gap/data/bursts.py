"""Rows that come in bursts: their times say when they arrived, not when they were read.

A serial port or a radio that is emptied now and then hands over many rows at once. Between two of
them the simulator has hardly any time to move, and the log's usual step says nothing of its pace.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from residual.logs.checks import Finding
from residual.trajectories import Trajectory

#: Times the usual step that one between bursts is longer; how many there are at least, and their
#: part of the time.
LONG, ENOUGH, MOST = 10.0, 10, 0.8
#: Part of the time between bursts that one lasts, at most: a longer one is a record of its own.
BRIEF = 0.1


def without_bursts(
    trajectories: Sequence[Trajectory],
) -> tuple[list[Trajectory], list[Finding]]:
    """The runs with the last row of every burst, and what was found.

    Args:
        trajectories: Measured runs.
    """
    runs = list(trajectories)
    durations = np.concatenate([run.durations for run in runs] or [np.zeros(0)])
    if len(durations) < ENOUGH:
        return runs, []
    long = durations > LONG * np.median(durations)
    apart, total = durations[long], durations.sum()
    if len(apart) < ENOUGH or apart.sum() < MOST * total:
        return runs, []
    if (total - apart.sum()) / len(apart) > BRIEF * np.median(apart):
        return runs, []
    kept, rows = [], 0
    for run in runs:
        last = np.append(run.durations > LONG * np.median(durations), True)
        rows += len(last) - int(last.sum())
        kept.append(
            replace(
                run, times=run.times[last], states=run.states[last], actions=run.actions[last[:-1]]
            )
        )
    every = float(np.median(apart))
    says = (
        f"rows come in bursts, one every {every:.3g} s: they say when rows arrived, not when they "
        f"were read. The last one of each was taken, and {rows} rows were left out: log the "
        "sensor's own time"
    )
    return kept, [Finding("bursts", "", says, {"every_s": every, "rows": rows}, "warning")]
