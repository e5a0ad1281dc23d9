"""All recorded samples of a set of trajectories in one flat table."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import itertools
import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.merging import Merging
from residual.trajectories import Trajectory
from sims.simulator import Channel

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class Recorded:
    """Inputs as recorded, of one run.

    Attributes:
        actions: Action held from each sample to the next, shape (n, n_a).
        durations: Seconds to the next sample, shape (n,).
        rows: Which of the samples are rows of the table.
        before: Action held before the first sample, shape (n_a,), if not the first one.
    """

    actions: Array
    durations: Array
    rows: NDArray[np.int64]
    before: Array | None = None

    @property
    def first(self) -> Array:
        """Action that was held for long when the run began, shape (n_a,)."""
        return self.actions[0] if self.before is None else self.before


@dataclasses.dataclass(frozen=True)
class Commands:
    """Inputs as recorded, of all runs.

    Attributes:
        actions: Action held from each sample to the next, shape (T, n_a).
        durations: Seconds to the next sample, shape (T,).
        own: Which were recorded; the others were held before a run, (T,).
        begins: Where every run but the first begins.
    """

    actions: Array
    durations: Array
    own: NDArray[np.bool_]
    begins: list[int]


@dataclasses.dataclass(frozen=True)
class Samples:
    """Samples of all runs, one row each, runs one after the other.

    A log that is sampled much faster than the system moves is thinned: of every ``stride`` samples
    one is a row, the first of those with the most readings, and an interval spans the recorded
    ones up to the next row. Inputs are kept as recorded.

    Attributes:
        seen: Measured state channels, shape (n, n_s); NaN where not measured.
        actions: Action at each row, shape (n, n_a); a run's last row repeats the one before.
        durations: Seconds to the next row, shape (n,); a run's last row repeats the one before.
        times: Seconds since the start of the log, shape (n,).
        runs: First and one-past-last row of every run.
        names: Name of every run.
        substeps: Sub-steps to integrate between two rows.
        stride: Recorded samples for a row.
        recorded: Inputs of every run as recorded.
    """

    seen: Array
    actions: Array
    durations: Array
    times: Array
    runs: tuple[tuple[int, int], ...]
    names: tuple[str, ...]
    substeps: int
    stride: int
    recorded: tuple[Recorded, ...]

    @classmethod
    def join(cls, trajectories: Sequence[Trajectory], substeps: int, stride: int = 1) -> Samples:
        """All trajectories below each other, whatever their order is.

        Raises:
            ValueError: There is no trajectory with a step.
        """
        usable = in_order(trajectories, stride)
        if not usable:
            raise ValueError("no trajectory to look at: give at least one with a step")
        parts, ends, kept = [], [0], []
        for run in usable:
            rows = _rows(run.states, stride)
            kept.append(rows)
            actions = np.vstack([run.actions, run.actions[-1:]])[rows]
            steps = np.diff(run.times[rows])
            parts.append((run.states[rows], actions, np.append(steps, steps[-1]), run.times[rows]))
            ends.append(ends[-1] + len(rows))
        seen, actions, durations, times = (np.concatenate(c) for c in zip(*parts, strict=True))
        return cls(
            seen=seen.astype(float),
            actions=actions.astype(float),
            durations=durations,
            times=times,
            runs=tuple(itertools.pairwise(ends)),
            names=tuple(t.name for t in usable),
            substeps=substeps,
            stride=stride,
            recorded=tuple(
                Recorded(
                    np.vstack([t.actions, t.actions[-1:]]),
                    np.append(t.durations, t.durations[-1]),
                    rows,
                    t.before,
                )
                for t, rows in zip(usable, kept, strict=True)
            ),
        )

    def __len__(self) -> int:
        return len(self.seen)

    def of_these(self, other: Samples, values: Array) -> Array:
        """Of values of another table's measured channels, (m,), those of its own.

        Raises:
            KeyError: The other one does not measure one of them.
        """
        place = {column: i for i, column in enumerate(other.measured)}
        return values[[place[column] for column in self.measured]]

    @property
    def measured(self) -> NDArray[np.int64]:
        """Columns of the channels that were measured at all."""
        return np.flatnonzero(np.isfinite(self.seen).any(axis=0))

    @property
    def owner(self) -> NDArray[np.int64]:
        """Index of the run of every row, shape (n,)."""
        return np.repeat(np.arange(len(self.runs)), [stop - start for start, stop in self.runs])

    @property
    def step(self) -> float:
        """Usual seconds between two rows."""
        return float(np.median(self.durations))

    @property
    def recorded_step(self) -> float:
        """Usual seconds between two recorded samples."""
        return float(np.median(np.concatenate([one.durations for one in self.recorded])))

    @property
    def recorded_substeps(self) -> int:
        """Sub-steps of a recorded interval."""
        return max(1, self.substeps // self.stride)

    @functools.cached_property
    def commands(self) -> Commands:
        """What was recorded of the inputs, all runs below each other."""
        actions, durations, own = [], [], []
        for recorded in self.recorded:
            earlier = 0 if recorded.before is None else 1
            if recorded.before is not None:
                actions.append(recorded.before[None])
            actions.append(recorded.actions)
            durations += [recorded.durations[:earlier], recorded.durations]
            own.append(np.arange(earlier + len(recorded.actions)) >= earlier)
        begins = np.cumsum([len(one) for one in own])[:-1].tolist()
        return Commands(
            np.concatenate(actions), np.concatenate(durations), np.concatenate(own), begins
        )

    def in_intervals(self, driven: Array) -> Array:
        """Inputs of recorded intervals put together to those of rows.

        Args:
            driven: Mean and rise in every sub-step of the intervals of ``commands``,
                (V, T, ``recorded_substeps``, n_a, 2).

        Returns:
            (V, rows, ``self.substeps``, n_a, 2).
        """
        if not self.commands.own.all():
            driven = driven[:, self.commands.own]
        if self.stride == 1:
            return driven
        ends = np.cumsum([len(recorded.actions) for recorded in self.recorded])
        runs = np.split(driven, ends[:-1], axis=1)
        parts = [one.rows(run) for one, run in zip(self._merging, runs, strict=True)]
        return np.concatenate(parts, axis=1)

    @functools.cached_property
    def _merging(self) -> tuple[Merging, ...]:
        """How the recorded intervals of every run make those of its rows."""
        found = []
        for recorded in self.recorded:
            first, end = recorded.rows[:-1, None], recorded.rows[1:, None]
            # Where readings are rare, rows differ; the shorter ones end with parts of no length.
            times = int((end - first).max(initial=1))
            width = self.stride * 2 ** max(0, math.ceil(math.log2(times / self.stride)))
            at = first + np.arange(width)
            durations = np.where(at < end, recorded.durations[np.minimum(at, end - 1)], 0.0)
            at = np.minimum(at, end - 1)
            found.append(Merging.of(at, durations, self.recorded_substeps, self.substeps))
        return tuple(found)


def in_order(trajectories: Sequence[Trajectory], stride: int) -> list[Trajectory]:
    """Runs of a row at least, in an order of their own: that of the files must not matter."""
    return sorted((t for t in trajectories if len(t) >= stride), key=_content)


def _rows(states: Array, stride: int) -> NDArray[np.int64]:
    """Of every ``stride`` samples the first of those with the most readings."""
    told = np.isfinite(states).sum(axis=1)
    begins = range(0, len(states), stride)
    return np.array([begin + int(told[begin : begin + stride].argmax()) for begin in begins])


def _content(run: Trajectory) -> bytes:
    """Puts runs in an order that depends on what was measured alone."""
    parts = (run.states, run.actions, run.durations)
    return hashlib.sha256(b"".join(np.ascontiguousarray(p).tobytes() for p in parts)).digest()


def unseen(channels: Sequence[Channel], measured: Iterable[int]) -> NDArray[np.bool_]:
    """States of which the log says nothing: not measured, nor rates of what was, (n_p,)."""
    seen = {channels[i].name for i in measured}
    return np.array([not {c.name, c.rate_of} & seen for c in channels], bool)
