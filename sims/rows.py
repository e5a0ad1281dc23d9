"""What is known of every row of a batch while it moves: arrays, joints first and rows last.

A column of one quantity is then contiguous, which NumPy needs to round equally in every batch.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sims.simulator import Array

Mask = NDArray[np.bool_]
Rows = NDArray[np.intp]

# Events that one row may have within a sub-step; after these, rates that would change their
# sign against friction are set to zero.
MOST_EVENTS = 6


class State(NamedTuple):
    """Positions q and rates v (n_joints, n), and places in the play x (n_plays, n)."""

    q: Array
    v: Array
    x: Array

    def take(self, rows: Rows) -> State:
        """The same for some rows."""
        return State(self.q.take(rows, 1), self.v.take(rows, 1), self.x.take(rows, 1))

    def put(self, rows: Rows, other: State) -> None:
        """Overwrite some rows."""
        self.q[:, rows], self.v[:, rows], self.x[:, rows] = other


class Limits(NamedTuple):
    """What can hold.

    Args:
        rest: (n_joints, n) most that friction can hold at rest.
        edges: (n_plays, n) half the width of every play.
        joints: (n_plays,) the joint that it drives.
    """

    rest: Array
    edges: Array
    joints: Rows


class Mode(NamedTuple):
    """What holds between two events.

    Args:
        slip: (n_joints, n) sign of the rate that dry friction opposes, 0 where there is none.
        stuck: (n_joints, n) joints that friction holds.
        open: (n_plays, n) drives that run across their play.
        side: (n_plays, n) side on which a closed play transmits, 0 where there is no play.
    """

    slip: Array
    stuck: Mask
    open: Mask
    side: Array

    def take(self, rows: Rows) -> Mode:
        """The same for some rows."""
        return Mode(
            self.slip.take(rows, 1),
            self.stuck.take(rows, 1),
            self.open.take(rows, 1),
            self.side.take(rows, 1),
        )


class Clocks(NamedTuple):
    """Where every row is, each (n,).

    Args:
        row: Its number in the batch.
        step: Sub-step.
        began, aim: Shares of the sub-step where the present attempt begins and is to end.
        event: What is to happen at ``aim``, -1 for nothing.
        left: Events that it may still have in the sub-step.
    """

    row: Rows
    step: Rows
    began: Array
    aim: Array
    event: Rows
    left: Rows

    @classmethod
    def start(cls, n: int) -> Clocks:
        """Every row at the beginning."""
        zeros, none = np.zeros(n, np.intp), np.full(n, -1, np.intp)
        return cls(np.arange(n), zeros, np.zeros(n), np.ones(n), none, zeros + MOST_EVENTS)

    def take(self, rows: Rows) -> Clocks:
        """Only some rows."""
        return Clocks(
            self.row[rows],
            self.step[rows],
            self.began[rows],
            self.aim[rows],
            self.event[rows],
            self.left[rows],
        )
