"""Which part of the logs is held out to confirm what is found in the rest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from residual.trajectories import Trajectory

#: Share of the input's changes that a held-out end should see: without any, forecasts of it
#: show nothing of how the system answers to its input.
CHANGES = 0.2
#: Samples before such a change, from which a forecast finds its start state.
LEAD = 15


def split(trajectories: Sequence[Trajectory]) -> tuple[list[Trajectory], list[Trajectory]]:
    """Training and held-out runs: the last fifth of the runs, or the end of each."""
    count = len(trajectories)
    if count >= 4:
        last = max(1, round(0.2 * count))
        return list(trajectories[:-last]), list(trajectories[-last:])
    train, held = [], []
    for run in trajectories:
        cut = end_of_training(run)
        train.append(part(run, 0, cut))
        held.append(part(run, cut, len(run)))
    return train, held


def end_of_training(run: Trajectory) -> int:
    """Sample at which the held-out end begins.

    That is the last quarter; if the input hardly changes there, the end reaches back to the
    latest change that makes up for it, as far as half of the run is left for training.
    """
    quarter = round(0.75 * len(run))
    changes = np.abs(np.diff(run.actions, axis=0, prepend=run.actions[:1]))
    spans = np.ptp(run.actions, axis=0) if len(run.actions) else np.zeros(0)
    moving = spans > 0
    if not moving.any():
        return quarter
    changed = (changes[:, moving] / spans[moving]).sum(axis=1)
    ahead = changed[::-1].cumsum()[::-1]
    enough = np.flatnonzero(ahead >= CHANGES * ahead[0])
    cut = min(quarter, int(enough[-1]) - LEAD)
    return cut if 2 * cut >= len(run) else quarter


def part(run: Trajectory, start: int, stop: int) -> Trajectory:
    """Samples ``start`` to ``stop`` of a run, both included."""
    return Trajectory(
        run.name, run.times[start : stop + 1], run.states[start : stop + 1],
        run.actions[start:stop],
    )  # fmt: skip
