"""A stretch of one record, in which most of an error lies."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from residual.trajectories import Trajectory, moment

#: Part of the motion over that of the error, from which on it may be the motion that is not known;
#: part of the motion without which the log tells of rest alone.
MOVES, ALL = 0.5, 0.9


@dataclasses.dataclass(frozen=True)
class Stretch:
    """Where it is.

    Attributes:
        run: Name of the run.
        begin, end: Its first and last row, in s since the start of the log.
        share: Its part of the nominal simulator's squared error, or of what is left of it.
        motion: Its part of the squared motion.
        beside: Whether it is what is left beside something that was named.
    """

    run: str
    begin: float
    end: float
    share: float
    motion: float
    beside: bool = False

    @property
    def indispensable(self) -> bool:
        """Whether nearly all of the motion lies in it."""
        return self.motion > ALL

    def says(self, left_out: bool) -> str:
        """A sentence for the user."""
        error = "squared error that is left" if self.beside else "squared error"
        told = (
            f"{self.share:.0%} of the {error} lies in one stretch, {self.run} from "
            f"{moment(self.begin)} to {moment(self.end)}, and nothing that was tried explains it: "
        )
        moves = self.motion > MOVES * self.share
        told += (
            f"{self.motion:.0%} of the motion lies there, too, so that more of its kind, in other "
            "records, may tell"
            if moves
            else "was it held, knocked or reset there, or did it move so only there?"
        )
        if left_out:
            return f"{told}{'.' * moves} It was left out of everything that is said"
        return told if moves else f"{told} Look there, then leave it out or log more of its kind"

    def cut_from(self, runs: Sequence[Trajectory]) -> tuple[Trajectory, ...]:
        """The runs without it: what comes before and after are runs of their own."""
        kept: list[Trajectory] = []
        for run in runs:
            inside = (run.times >= self.begin) & (run.times <= self.end)
            if run.name != self.run or not inside.any():
                kept.append(run)
                continue
            first, last = np.flatnonzero(inside)[[0, -1]]
            for a, b in ((0, int(first)), (int(last) + 1, len(run.times))):
                if b - a > 1:
                    kept.append(run.piece(a, b))
        return tuple(kept)
