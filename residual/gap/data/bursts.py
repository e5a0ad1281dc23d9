"""Rows that come in bursts: their times say when they arrived, not when they were read.

A serial port or a radio that is emptied now and then hands over many rows at once. Between two of
them the simulator has hardly any time to move, and the log's usual step says nothing of its pace.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from residual.logs.checks import Finding
from residual.trajectories import Trajectory

#: Times the usual step that one between bursts is longer; how many there are at least, and their
#: part of the time.
LONG, ENOUGH, MOST = 10.0, 10, 0.8
#: Part of the time between bursts that one lasts, and of its range that a channel moves in it, at
#: most: else it is a record of its own.
BRIEF, STILL = 0.1, 0.1
#: Rows of a usual burst at the least.
SEVERAL = 2


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
    least = LONG * np.median(durations)
    apart, total = durations[durations > least], durations.sum()
    if len(apart) < ENOUGH or apart.sum() < MOST * total:
        return runs, []
    if (total - apart.sum()) / len(apart) > BRIEF * np.median(apart):
        return runs, []
    ends = [np.append(run.durations > least, True) for run in runs]
    if _are_alone(runs, ends, float(np.median(apart))) or _moves(runs, ends):
        return runs, []
    kept, rows = [], 0
    for run, last in zip(runs, ends, strict=True):
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


def _are_alone(runs: Sequence[Trajectory], ends: Sequence[NDArray[np.bool_]], apart: float) -> bool:
    """Whether most rows that end a burst have none before them, or one burst lasts longer than two
    usually are ``apart``: a logger that is slow at rest and fast where something happens."""
    times = [
        part
        for run, last in zip(runs, ends, strict=True)
        for part in np.split(run.times, np.flatnonzero(last)[:-1] + 1)
    ]
    longest = max(part[-1] - part[0] for part in times)
    return bool(np.median([len(part) for part in times]) < SEVERAL or longest > apart)


def _moves(runs: Sequence[Trajectory], ends: Sequence[NDArray[np.bool_]]) -> bool:
    """Whether some channel moves within bursts, that end where told."""
    bursts = [
        part
        for run, last in zip(runs, ends, strict=True)
        for part in np.split(run.states, np.flatnonzero(last)[:-1] + 1)
    ]
    whole = np.concatenate(bursts)
    with np.errstate(invalid="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of channels that were not measured
        reach = np.nanmax(whole, axis=0) - np.nanmin(whole, axis=0)
        moved = [np.nanmax(part, axis=0) - np.nanmin(part, axis=0) for part in bursts]
        usual = np.nanmedian(moved, axis=0)
    return bool((usual > STILL * reach).any())
