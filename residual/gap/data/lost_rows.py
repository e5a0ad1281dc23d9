"""Rows that a log lost where a command changed: nobody knows then when it did."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.samples import Samples
from residual.gap.data.windows import Windows
from residual.logs.checks import Finding
from residual.trajectories import Trajectory
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: Usual steps from which on a step has lost rows, and as many as may be without being a pause.
LOST, MOST = 1.5, 10.0
#: Part of the steps that may have lost some: beyond it, that is how the log was sampled.
FEW = 0.1
#: Part of the steps from one row to the next in which a command that is held stays as it is.
HELD = 0.5
#: Part of a command's range by which it changes at once where that matters.
MUCH = 0.1
#: Usual steps up to which a change has a time.
TIMED = 1.25


def timed_halfway(
    simulator: HostSimulator, trajectories: Sequence[Trajectory]
) -> tuple[list[Trajectory], list[Finding]]:
    """Runs in which commands that change while rows are missing do so half-way, and what to say.

    A command that is held came on with one of the rows that were lost or with the next one, which
    is the first that has it. To take that for its time makes delays too short, and lags, too.

    Args:
        simulator: Has the inputs.
        trajectories: Measured runs.

    Returns:
        The runs, with a row without readings where such a command is taken to change.
    """
    runs = list(trajectories)
    steps = np.concatenate([run.durations for run in runs])
    usual = float(np.median(steps))
    lost = steps > LOST * usual
    if simulator.has_contacts or not lost.any() or lost.mean() > FEW:
        return runs, []
    held = np.mean([_stays(run, usual) for run in runs], axis=0) > HELD
    least = MUCH * np.ptp(np.concatenate([run.actions for run in runs]), axis=0)
    found, total = np.zeros(len(held), int), np.zeros(len(held), int)
    for number, run in enumerate(runs):
        changes = (np.abs(np.diff(run.actions, axis=0)) > least) & held
        gaps = run.durations[:-1]
        untimed = changes & ((gaps > LOST * usual) & (gaps < MOST * usual))[:, None]
        total, found = total + changes.sum(axis=0), found + untimed.sum(axis=0)
        if untimed.any():
            runs[number] = _with_rows(run, np.flatnonzero(untimed.any(axis=1)), usual, held)
    says = [
        Finding(
            "lost_rows",
            channel.name,
            f"changes {count} of {all_} times where rows were lost: it is taken to do so half-way",
            {"changes": int(count)},
        )
        for channel, count, all_ in zip(simulator.action_channels, found, total, strict=True)
        if count
    ]
    return runs, says


def untimed_changes(samples: Samples, windows: Windows) -> NDArray[np.bool_]:
    """Windows in which an input changes while rows are missing, (W,).

    One that is held has no time there, and seems to run straight, which errs by half as much.
    """
    usual = samples.recorded_step
    found = np.zeros(len(windows), bool)
    for k, (run, first, end) in enumerate(windows.pieces):
        recorded, start = samples.recorded[run], samples.runs[run][0]
        within = slice(recorded.rows[first - start], recorded.rows[end - 1 - start] + 1)
        changes = (np.diff(recorded.actions[within], axis=0) != 0).any(axis=1)
        found[k] = (changes & (recorded.durations[within][:-1] > TIMED * usual)).any()
    return found


def _stays(run: Trajectory, usual: float) -> Array:
    """Part of the steps without lost rows in which each input stays as it is, (n_a,)."""
    whole = run.durations[:-1] <= LOST * usual
    if not whole.any():
        return np.zeros(run.actions.shape[1])
    return np.asarray((np.diff(run.actions, axis=0)[whole] == 0).mean(axis=0))


def _with_rows(
    run: Trajectory, steps: NDArray[np.int64], usual: float, held: NDArray[np.bool_]
) -> Trajectory:
    """A run with a row without readings in some steps, in which the next command begins."""
    times = run.times[steps] + 0.5 * (run.durations[steps] + usual)
    before, after = run.actions[steps], run.actions[steps + 1]
    actions = np.where(held, after, 0.5 * (before + after))
    return dataclasses.replace(
        run,
        times=np.insert(run.times, steps + 1, times),
        states=np.insert(run.states, steps + 1, np.nan, axis=0),
        actions=np.insert(run.actions, steps + 1, actions, axis=0),
    )
