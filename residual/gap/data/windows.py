"""Windows of consecutive samples, cut by local instability."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.samples import Samples

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class Windows:
    """Non-overlapping stretches of consecutive samples, padded to one length.

    Attributes:
        index: Row of every sample of every window, shape (W, L); padding repeats the last row.
        inside: False where padded, shape (W, L).
        run: Which run each window belongs to, shape (W,).
    """

    index: NDArray[np.int64]
    inside: NDArray[np.bool_]
    run: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.index)

    def __getitem__(self, part: slice | NDArray[np.generic]) -> Windows:
        return Windows(self.index[part], self.inside[part], self.run[part])

    @classmethod
    def cut(cls, pieces: list[tuple[int, int, int]]) -> Windows:
        """Windows from (run, first row, one past last row)."""
        longest = max(stop - start for _, start, stop in pieces)
        index = np.array([np.minimum(np.arange(a, a + longest), b - 1) for _, a, b in pieces])
        lengths = np.array([b - a for _, a, b in pieces])
        inside = np.arange(longest) < lengths[:, None]
        return cls(index, inside, np.array([run for run, _, _ in pieces]))

    @property
    def pieces(self) -> list[tuple[int, int, int]]:
        """(run, first row, one past last row) of every window."""
        lengths = self.inside.sum(axis=1)
        return [
            (int(r), int(i[0]), int(i[0] + n))
            for r, i, n in zip(self.run, self.index, lengths, strict=True)
        ]


class TooShort(ValueError):
    """No record holds a window."""

    def __init__(self, shortest: int) -> None:
        super().__init__(
            f"every record is shorter than {shortest} samples, the least for a window: log longer"
        )


def fixed(samples: Samples, length: int, shortest: int = 4) -> Windows:
    """Windows of ``length`` samples; what is left at a run's end is a window if long enough.

    Raises:
        TooShort: No run is.
    """
    pieces = []
    for run, (start, stop) in enumerate(samples.runs):
        for a in range(start, stop, length):
            if min(a + length, stop) - a >= shortest:
                pieces.append((run, a, min(a + length, stop)))
    if not pieces:
        raise TooShort(shortest)
    return Windows.cut(pieces)


def cut(
    samples: Samples,
    jacobians: Array,
    scale: Array,
    seconds: float,
    shortest: int = 6,
    growth: float = 40.0,
) -> Windows:
    """Windows of about one length that share no sample, runs divided evenly.

    A window ends earlier where an error of the start state would have grown ``growth``-fold: near
    an unstable equilibrium a long one outlives what its start state can tell, and its residual
    measures chaos instead of the model.

    Args:
        samples: The table.
        jacobians: Derivative of every next state by its state, shape (n, n_s, n_s).
        scale: Typical variation of each state, to make states of different units comparable.
        seconds: Wanted length of a window.
        shortest: Fewest samples with a reading in a window.
        growth: Largest allowed norm of the product of the scaled Jacobians.

    Raises:
        TooShort: No run has samples enough for a window.
    """
    scaled = jacobians * scale[None, None, :] / scale[None, :, None]
    before = np.append(0, np.cumsum(np.isfinite(samples.seen).any(axis=1)))

    def readings(first: int, end: int) -> int:
        return int(before[end] - before[first])

    pieces = []
    for run, (start, stop) in enumerate(samples.runs):
        if readings(start, stop) < shortest:
            continue
        spans = samples.times[stop - 1] - samples.times[start]
        count = max(1, min(round(float(spans) / seconds), readings(start, stop) // shortest))
        edges = np.linspace(start, stop, count + 1).round().astype(int)
        for first, last in itertools.pairwise(edges.tolist()):
            a = first
            while readings(a, last) >= shortest:
                product, size = np.eye(len(scale)), 1
                while a + size < last:
                    with np.errstate(over="ignore", invalid="ignore"):
                        product = scaled[a + size - 1] @ product
                    enough = readings(a, a + size) >= shortest
                    if enough and _grown(product, growth):
                        break
                    size += 1
                if readings(a + size, last) < shortest:
                    size = last - a
                pieces.append((run, a, a + size))
                a += size
    if not pieces:
        raise TooShort(shortest)
    return Windows.cut(pieces)


def _grown(product: Array, growth: float) -> bool:
    """Whether errors grow by more than a factor; what overflows before readings come has."""
    return not np.isfinite(product).all() or bool(np.linalg.norm(product, 2) > growth)
