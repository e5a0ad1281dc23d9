"""Records that were given twice: the same samples are no second measurement."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from residual.logs.checks import Finding
from residual.trajectories import Trajectory

#: Samples at which something changed that two measurements do not share to the last digit.
SHARED = 10
#: Samples in a row, all different, that two measurements do not share either.
STRETCH = 30


def copies(
    trajectories: Sequence[Trajectory], among: Sequence[Trajectory] = ()
) -> list[tuple[Trajectory, Trajectory]]:
    """Records that hold the same samples as an earlier one, under whatever name and start time.

    Args:
        trajectories: Measured records.
        among: Other records that count as earlier.

    Returns:
        Each copy with the record that it repeats.
    """
    seen = {_content(run): run for run in reversed(among)}
    found = []
    for run in trajectories:
        content = _content(run)
        first = seen.setdefault(content, run)
        if first is not run and _changes(run) >= SHARED:
            found.append((run, first))
    return found


def shared(
    trajectories: Sequence[Trajectory], among: Sequence[Trajectory]
) -> list[tuple[Trajectory, Trajectory]]:
    """Records that share samples with one of the others: copies, parts, overlaps.

    Returns:
        Each with the first record that it shares some with.
    """
    found = copies(trajectories, among)
    known = {id(run) for run, _ in found}
    for run in [run for run in trajectories if id(run) not in known]:
        other = next((other for other in among if _overlap(run, other)), None)
        if other is not None:
            found.append((run, other))
    return found


def _overlap(one: Trajectory, other: Trajectory) -> bool:
    """Whether two records hold the same samples in a row, all of them different."""
    tables = [np.hstack([run.states[:-1], run.actions]).astype(float) for run in (one, other)]
    if tables[0].shape[1] != tables[1].shape[1] or min(map(len, tables)) < STRETCH:
        return False
    _, rows = np.unique(np.concatenate(tables), axis=0, return_inverse=True)
    mine, its = np.split(rows.ravel(), [len(tables[0])])
    # A stretch of twice that length holds one that begins at a multiple of it.
    there = {stretch.tobytes() for stretch in sliding_window_view(its, STRETCH)[::STRETCH]}
    return any(
        stretch.tobytes() in there and len(set(stretch.tolist())) == STRETCH
        for stretch in sliding_window_view(mine, STRETCH)
    )


def once(trajectories: Sequence[Trajectory]) -> tuple[list[Trajectory], list[Finding]]:
    """Records without those that repeat an earlier one, and what was left out."""
    found = copies(trajectories)
    gone = {id(copy) for copy, _ in found}
    told = []
    if found:
        copy, first = found[0]
        more = f" (and {len(found) - 1} more so)" if len(found) > 1 else ""
        says = (
            f"holds the same samples as {first.name}{more}: used once, since a copy is no second "
            "measurement"
        )
        told.append(Finding("copy", copy.name, says, {"copies": len(found)}, "warning"))
    return [run for run in trajectories if id(run) not in gone], told


def _content(run: Trajectory) -> tuple[bytes, bytes]:
    # Zeros of either sign are the same number.
    return (np.asarray(run.states, float) + 0.0).tobytes(), (
        np.asarray(run.actions, float) + 0.0
    ).tobytes()


def _changes(run: Trajectory) -> int:
    """Samples at which a measured state is not what it was."""
    return int((np.nan_to_num(np.diff(run.states, axis=0)) != 0).any(axis=1).sum())
