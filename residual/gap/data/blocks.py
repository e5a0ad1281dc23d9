"""Blocks of consecutive time, dealt over folds so that every fold interpolates.

What is held out of a fit must be like what is fitted: the last file of an experiment series is
often the fastest one, and to foretell it is another question. So all records are cut into blocks
of a few horizons, the blocks are sorted by how hard they are driven, and dealt over the folds like
cards. Order, names and cuts of the files do not matter.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.samples import Samples
from residual.gap.data.windows import Windows

Array = NDArray[np.float64]

#: Folds of the cross-validation.
FOLDS = 5
#: Windows in a block, the first number that gives ``ENOUGH`` blocks.
SIZES = (3, 2, 1)
ENOUGH = 8


@dataclasses.dataclass(frozen=True)
class Blocks:
    """Windows grouped in blocks, and blocks in folds.

    Attributes:
        windows: All windows.
        block: Block of every window, (W,).
        fold: Fold of every block, (B,).
    """

    windows: Windows
    block: NDArray[np.int64]
    fold: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.fold)

    @property
    def folds(self) -> int:
        """Number of folds."""
        return int(self.fold.max()) + 1

    @property
    def fold_of_window(self) -> NDArray[np.int64]:
        """Fold of every window, (W,)."""
        return self.fold[self.block]

    def of(self, part: NDArray[np.bool_]) -> Blocks:
        """The same with a part of the windows, (W,)."""
        return Blocks(self.windows[part], self.block[part], self.fold)


def blocks(samples: Samples, windows: Windows, drive: Array, most: int) -> Blocks:
    """Group windows that follow each other, and deal the groups over folds.

    Args:
        samples: The table.
        windows: All that could be cut, in order of time within each run.
        drive: How hard every row is driven, (n,).
        most: Largest number of windows kept; blocks are left out evenly over the drive.
    """
    for size in SIZES:
        groups = _groups(windows, size)
        if len(groups) >= ENOUGH:
            break
    hard = np.array([drive[windows.index[group][windows.inside[group]]].mean() for group in groups])
    order = np.argsort(hard, kind="stable")
    size = max(len(group) for group in groups)
    keep = min(len(groups), max(ENOUGH, most // size))
    order = order[np.unique(np.linspace(0, len(groups) - 1, keep).round().astype(int))]
    folds = min(FOLDS, len(order))
    fold = np.empty(len(order), np.int64)
    for rank in range(len(order)):
        lap, place = divmod(rank, folds)
        fold[rank] = place if lap % 2 == 0 else folds - 1 - place
    kept = [groups[i] for i in order]
    # Windows stay in the order of time, blocks are numbered by their first window.
    first = np.argsort([group[0] for group in kept], kind="stable")
    kept = [kept[i] for i in first]
    which = np.concatenate(kept)
    owner = np.repeat(np.arange(len(kept)), [len(group) for group in kept])
    return Blocks(windows[which], owner, fold[first])


def _groups(windows: Windows, size: int) -> list[NDArray[np.int64]]:
    """Numbers of windows that follow each other in a run, ``size`` at a time."""
    found = []
    for run in np.unique(windows.run):
        own = np.flatnonzero(windows.run == run)
        count = max(1, round(len(own) / size))
        found += [part for part in np.array_split(own, count) if len(part)]
    return found


def drive(samples: Samples, nodes: Array, rates: NDArray[np.int64]) -> Array:
    """How hard every row is driven: speeds, inputs and changes of inputs, each in its own spread.

    Args:
        samples: The table.
        nodes: States at every row, (n, n_s).
        rates: Columns of rates, or of the states of a first-order system.
    """
    columns = [nodes[:, i] for i in rates] + list(samples.actions.T)
    total = np.zeros(len(samples))
    for column in columns:
        spread = float(np.std(column))
        if spread > 0:
            total += ((column - np.median(column)) / spread) ** 2
    return total
