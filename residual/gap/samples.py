"""All recorded samples of a set of trajectories in one flat table."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from residual.trajectories import Trajectory

Array = NDArray[np.float64]
Hold = Literal["zero", "linear"]


@dataclasses.dataclass(frozen=True)
class Samples:
    """Samples of all runs, one row each, runs one after the other.

    Attributes:
        seen: Measured state channels, shape (n, n_s); NaN where not measured.
        actions: Action held from this sample to the next, shape (n, n_a); a run's last row
            repeats the one before.
        durations: Seconds to the next sample, shape (n,); a run's last row repeats the one before.
        times: Seconds since the start of the log, shape (n,).
        runs: First and one-past-last row of every run.
        names: Name of every run.
        substeps: Sub-steps to integrate between two samples.
        hold: How the input runs between samples, ``"zero"`` or ``"linear"``.
    """

    seen: Array
    actions: Array
    durations: Array
    times: Array
    runs: tuple[tuple[int, int], ...]
    names: tuple[str, ...]
    substeps: int
    hold: Hold = "zero"

    @classmethod
    def join(
        cls, trajectories: Sequence[Trajectory], substeps: int, hold: Hold = "zero"
    ) -> Samples:
        """All trajectories below each other.

        Raises:
            ValueError: There is no trajectory.
        """
        if not trajectories:
            raise ValueError("no trajectory to look at: give at least one")
        ends = np.cumsum([len(t.times) for t in trajectories]).tolist()
        return cls(
            seen=np.concatenate([t.states for t in trajectories]).astype(float),
            actions=np.concatenate([np.vstack([t.actions, t.actions[-1:]]) for t in trajectories]),
            durations=np.concatenate(
                [np.append(t.durations, t.durations[-1]) for t in trajectories]
            ),
            times=np.concatenate([t.times for t in trajectories]),
            runs=tuple(zip([0, *ends[:-1]], ends, strict=True)),
            names=tuple(t.name for t in trajectories),
            substeps=substeps,
            hold=hold,
        )

    def __len__(self) -> int:
        return len(self.seen)

    @property
    def measured(self) -> NDArray[np.int64]:
        """Columns of the channels that were measured at all."""
        return np.flatnonzero(np.isfinite(self.seen).any(axis=0))

    @property
    def owner(self) -> NDArray[np.int64]:
        """Index of the run of every row, shape (n,)."""
        return np.repeat(np.arange(len(self.runs)), [stop - start for start, stop in self.runs])

    def pick(self, which: Sequence[int]) -> tuple[Samples, NDArray[np.int64]]:
        """Only some runs, and the rows they had in this table."""
        rows = np.concatenate([np.arange(*self.runs[i]) for i in which])
        ends = np.cumsum([self.runs[i][1] - self.runs[i][0] for i in which]).tolist()
        part = dataclasses.replace(
            self,
            seen=self.seen[rows],
            actions=self.actions[rows],
            durations=self.durations[rows],
            times=self.times[rows],
            runs=tuple(zip([0, *ends[:-1]], ends, strict=True)),
            names=tuple(self.names[i] for i in which),
        )
        return part, rows
