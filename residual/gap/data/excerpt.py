"""Of records too long to be searched whole: stretches, evenly spread over all of them.

Memory and time of a search grow with its rows, while what they tell about a few numbers does not:
the error falls with the square root of the rows, and other errors are larger long before.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from residual.trajectories import Trajectory

#: Rows that are searched: of a system with two states they take less than two gigabytes.
MOST = 50_000
#: Rows in a stretch, many times a window.
STRETCH = 1000


def excerpt(
    runs: Sequence[Trajectory], stride: int, most: int = MOST
) -> tuple[tuple[Trajectory, ...], list[str]]:
    """The runs as they are, or stretches of them if they are longer than can be searched.

    Args:
        runs: Measured runs.
        stride: Recorded samples in a row.
        most: Rows to be searched.

    Returns:
        Runs of together about ``most`` rows, and a sentence on what was left out, if anything.
    """
    total = sum(len(run) for run in runs)
    if total <= most * stride:
        return tuple(runs), []
    length = STRETCH * stride
    pieces = [
        run.piece(a, b + 1)
        for run in runs
        for a in range(0, len(run), length)
        for b in (min(a + length, len(run)),)
    ]
    count = max(1, round(len(pieces) * most * stride / total))
    chosen = np.linspace(0, len(pieces) - 1, count).round().astype(int)
    kept = tuple(pieces[i] for i in chosen)
    steps = sum(len(piece) for piece in kept)
    return kept, [
        f"{steps} of {total} steps are searched: {len(kept)} stretches, evenly spread over the runs"
    ]
