"""What was observed of a system: transitions for learning, trajectories for diagnosis."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simgap_files.arrays import FileError
from simgap_files.npz import read_npz, write_npz

Array = NDArray[np.float64]

# Seconds between which times count from 1970, as dates do from 1990 on: days may be counted, too.
_CALENDAR = 6.3e8, 1e11


@dataclasses.dataclass(frozen=True)
class Transitions:
    """Observed steps (s, a, s') of one control period each.

    Attributes:
        states: s, shape (n, n_s), in the units of the simulator's state channels.
        actions: a, shape (n, n_a).
        next_states: s', shape (n, n_s); angles continue those of ``states`` unwrapped. A channel
            without a sensor is NaN throughout, in both.
        episodes: Which episode each row belongs to, shape (n,), integers.
    """

    states: Array
    actions: Array
    next_states: Array
    episodes: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.states)

    def __repr__(self) -> str:
        episodes = len(np.unique(self.episodes))
        return f"Transitions({len(self)} rows of {episodes} episodes)"

    @classmethod
    def join(cls, parts: Sequence[Transitions]) -> Transitions:
        """All parts in order; episodes are renumbered so that they stay distinct."""
        episodes, first = [], 0
        for part in parts:
            episodes.append(part.episodes + first)
            first = int(episodes[-1].max()) + 1
        return cls(
            np.concatenate([part.states for part in parts]),
            np.concatenate([part.actions for part in parts]),
            np.concatenate([part.next_states for part in parts]),
            np.concatenate(episodes),
        )

    def runs(self, dt: float, name: str = "run") -> list[Trajectory]:
        """Every episode as a recorded run, with the control period ``dt`` in s between samples."""
        found: list[Trajectory] = []
        for episode in np.unique(self.episodes):
            rows = np.flatnonzero(self.episodes == episode)
            states = np.concatenate([self.states[rows], self.next_states[rows[-1:]]])
            times = np.asarray(dt * np.arange(len(states)), float)
            found.append(
                Trajectory(f"{name}-{len(found) + 1:02d}", times, states, self.actions[rows])
            )
        return found

    def save(self, path: Path) -> None:
        """Write all columns to one ``.npz`` file, whole or not at all.

        Raises:
            ValueError: ``load`` would refuse them: values that are not finite, or shapes that do
                not fit together.
        """
        refuse_arrays(str(path), vars(self))
        write_npz(path, vars(self))

    @classmethod
    def load(cls, path: Path) -> Transitions:
        """Read what ``save`` wrote; no code is run from the file.

        Raises:
            FileNotFoundError: There is no such file.
            ValueError: It is damaged, holds something else, or values that are not finite.
        """
        arrays = read_npz(path)
        names = [field.name for field in dataclasses.fields(cls)]
        if set(arrays) != set(names):
            found = ", ".join(sorted(arrays)) or "none"
            raise FileError(f"{path} holds arrays {found:.200}, expected {', '.join(names)}")
        refuse_arrays(str(path), arrays)
        return cls(**arrays)


def refuse_arrays(where: str, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Refuse columns that are no transitions, see ``Transitions``.

    Args:
        where: The file, for the message.
        arrays: Its columns by name.

    Raises:
        ValueError: The message says which column and, if it can, which row.
    """
    for name, array in arrays.items():
        kinds, ndim = ("iu", 1) if name == "episodes" else ("fiu", 2)
        if array.dtype.kind not in kinds or array.ndim != ndim:
            raise FileError(
                f"{where}: {name} holds {array.dtype} of shape {array.shape}, expected "
                f"{'integers' if ndim == 1 else 'numbers'} in {ndim} dimensions"
            )
    if len({len(array) for array in arrays.values()}) > 1 or (
        arrays["states"].shape != arrays["next_states"].shape
    ):
        shapes = ", ".join(f"{name} {array.shape}" for name, array in arrays.items())
        raise FileError(f"{where}: shapes that do not fit together: {shapes}")
    unmeasured = np.isnan([arrays["states"], arrays["next_states"]]).all(axis=(0, 1))
    for name, array in arrays.items():
        seen = array[:, ~unmeasured] if name in ("states", "next_states") else array
        if not np.isfinite(seen).all():
            row = int(np.argwhere(~np.isfinite(seen))[0][0])
            raise FileError(f"{where}: {name} holds values that are not finite, first in row {row}")


@dataclasses.dataclass(frozen=True)
class Trajectory:
    """One recorded run: samples in time order, and the action held after each sample.

    Attributes:
        name: Where it comes from (file and run), for messages.
        times: Sample times in s, strictly increasing, shape (T + 1,).
        states: Measured state channels, shape (T + 1, n_s); angles unwrapped; a channel
            that was not measured is NaN throughout, a missing sample is NaN in its row.
        actions: Action from sample k to sample k + 1, shape (T, n_a).
        before: Action that was held for long before the first sample, shape (n_a,), which delays
            and lags remember; by default the first one.
        converted: Units that columns were in when they were read, by channel, where that was not
            the channel's own.

    Raises:
        ValueError: The arrays do not belong together.
    """

    name: str
    times: Array
    states: Array
    actions: Array
    before: Array | None = None
    converted: Mapping[str, str] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        samples = len(self.times)
        for name, one in (("states", self.states), ("actions", self.actions)):
            if np.asarray(one).dtype.kind not in "fiub":
                raise ValueError(
                    f"{self.name}: {name} are {np.asarray(one).dtype.name}, expected numbers"
                )
            if np.ndim(one) != 2:
                raise ValueError(
                    f"{self.name}: {name} has shape {np.shape(one)}, expected two dimensions: a "
                    f"row for each sample and a column for each channel (values[:, None] for one)"
                )
        if len(self.states) != samples or len(self.actions) != samples - 1:
            raise ValueError(
                f"{self.name} has {samples} times, {len(self.states)} states and "
                f"{len(self.actions)} actions; expected as many states as times and one action "
                "less, each held from one sample to the next"
            )
        if self.before is not None and self.before.shape != self.actions.shape[1:]:
            raise ValueError(
                f"{self.name}: before has shape {self.before.shape}, expected "
                f"{self.actions.shape[1:]}, an entry for each input"
            )

    def piece(self, start: int, stop: int, name: str | None = None) -> Trajectory:
        """The samples from ``start`` to before ``stop``, under this or another name."""
        return Trajectory(
            self.name if name is None else name,
            self.times[start:stop],
            self.states[start:stop],
            self.actions[start : stop - 1],
            self.before if start == 0 else None,
            self.converted,
        )

    @property
    def durations(self) -> Array:
        """Time from each sample to the next, in s, shape (T,)."""
        return np.diff(self.times)

    def __len__(self) -> int:
        return len(self.actions)

    def __repr__(self) -> str:
        seconds = self.times[-1] - self.times[0] if len(self.times) else 0.0
        return f"Trajectory({self.name!r}, {len(self)} steps, {seconds:.4g} s)"


def converted_units(runs: Iterable[Trajectory]) -> dict[str, str]:
    """Units that columns of any run were in, by channel, where that was not the channel's own."""
    return {name: unit for run in runs for name, unit in run.converted.items()}


def duration_text(seconds: float) -> str:
    """A length of time in seconds, or in hours or days where there are two of them: ``1 s``."""
    longer = (pair for pair in ((86400.0, "d"), (3600.0, "h")) if seconds >= 2 * pair[0])
    size, unit = next(longer, (1.0, "s"))
    return f"{float(f'{seconds / size:.3g}'):g} {unit}"


def moment(seconds: float) -> str:
    """A time of a record, for messages; that of a calendar with its date."""
    if not _CALENDAR[0] <= seconds < _CALENDAR[1]:
        return f"{seconds:.6g} s"
    date = datetime.fromtimestamp(float(seconds), UTC)
    return f"{seconds:.2f} s ({date:%Y-%m-%d %H:%M:%S.%f}"[:-5] + " UTC)"


def trajectories_of(given: Any) -> list[Trajectory]:
    """Runs as a list, from one of them, several, or what ``residual.logs.read_logs`` returned.

    Raises:
        ValueError: It is something else, or the times of a run do not rise.
    """
    given = [given] if isinstance(given, Trajectory) else given
    given = getattr(given, "trajectories", given)
    listed = isinstance(given, Iterable) and not isinstance(given, str)
    runs = list(given) if listed else [given]
    for run in runs:
        if not isinstance(run, Trajectory):
            kind = type(run if isinstance(given, list | tuple) else given).__name__
            raise ValueError(
                f"expected measured runs (Trajectory), got {kind}: read logs with "
                "read_logs(paths, simulator.state_channels, simulator.action_channels)"
            )
        if not (run.durations > 0).all():
            row = int(np.argmin(run.durations > 0)) + 1
            before, after = run.times[row - 1 : row + 1]
            raise ValueError(
                f"{run.name}: times go from {before:g} to {after:g} s at row {row}, expected each "
                "to be later than the one before; sort the rows, or make a run of each part"
            )
    return runs
