"""Inputs of several recorded intervals as one row's: mean and rise in each of its sub-steps."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from sims.compiled import compiled

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Part of the usual interval of a row by which others may differ and still count alike.
EVEN = 0.2


@dataclasses.dataclass(frozen=True)
class Merging:
    """How the intervals of one record make those of its rows, whatever the input.

    A row's sub-steps have the integral and the first moment that the recorded intervals have in
    them. What is left to do for an input is a sum.

    Attributes:
        at: Recorded interval of every part of a row, (rows, width).
        uneven: Place of a row in ``weights``, -1 where its intervals count alike, (rows,).
        weights: Of mean and rise in every sub-step of the parts, in mean and rise of a row's,
            (uneven rows, width times fine, 2, count, 2).
        fine: Sub-steps of a recorded interval.
        count: Sub-steps of a row.
    """

    at: Integers
    uneven: Integers
    weights: Array
    fine: int
    count: int

    @classmethod
    def of(cls, at: Integers, durations: Array, fine: int, count: int) -> Merging:
        """Prepared for a record.

        Args:
            at: See the class.
            durations: Of each part, (rows, width); of a row that has fewer, the others take no
                time.
            fine, count: See the class.
        """
        differ = np.ptp(durations, axis=1) > EVEN * durations.mean(axis=1)
        uneven = np.where(differ, np.cumsum(differ) - 1, -1)
        weights = _by_time(np.repeat(durations[differ], fine, axis=1) / fine, count)
        return cls(at, uneven, weights, fine, count)

    def rows(self, driven: Array) -> Array:
        """Inputs of the rows, and last of one that holds what the record ends with.

        Args:
            driven: Mean and rise in every sub-step of the recorded intervals,
                (V, T, ``fine``, n_a, 2).

        Returns:
            (V, rows + 1, ``count``, n_a, 2).
        """
        variants, _, _, inputs, _ = driven.shape
        found = np.zeros((variants, len(self.at) + 1, self.count, inputs, 2))
        each = self.at.shape[1] * self.fine // self.count
        _merge(np.ascontiguousarray(driven), self.at, self.uneven, self.weights, found)
        found[:, -1] = driven[:, -1:, -1]
        found[:, -1, ..., 1] /= each
        return found


@compiled
def _merge(driven: Array, at: Integers, uneven: Integers, weights: Array, found: Array) -> None:
    """Sums of ``Merging.rows`` into ``found``, all but its last row."""
    fine, inputs, count = driven.shape[2], driven.shape[3], found.shape[2]
    total = at.shape[1] * fine
    each = total // count
    for v in range(len(driven)):
        for r in range(len(at)):
            for s in range(total):
                part = driven[v, at[r, s // fine], s % fine]
                if uneven[r] >= 0:
                    weight = weights[uneven[r], s]
                    for c in range(count):
                        for i in range(inputs):
                            for k in range(2):
                                found[v, r, c, i, k] += (
                                    weight[0, c, k] * part[i, 0] + weight[1, c, k] * part[i, 1]
                                )
                else:
                    c = s // each
                    place = s - c * each - 0.5 * (each - 1)
                    for i in range(inputs):
                        found[v, r, c, i, 0] += part[i, 0] / each
                        found[v, r, c, i, 1] += (12 * part[i, 0] * place + part[i, 1]) / each**2


def _by_time(durations: Array, count: int) -> Array:
    """Weights where sub-steps take unlike times, which are counted in those of their row.

    Args:
        durations: (rows, s).
        count: Sub-steps of a row.

    Returns:
        See ``Merging.weights``.
    """
    width = durations / durations.sum(axis=1, keepdims=True)
    end = np.cumsum(width, axis=1)
    middle = end - 0.5 * width
    edges = np.arange(count + 1) / count
    # What lies of each sub-step (rows, s) before each edge: up to x, begun at ``begin``.
    begin = (end - width)[..., None]
    x = np.clip(edges, begin, end[..., None])
    wide = np.maximum(width, np.finfo(float).tiny)[..., None]  # those without width hold nothing
    slant = ((x - middle[..., None]) ** 2 - (0.5 * width[..., None]) ** 2) / (2 * wide)
    cubes = (x**3 - begin**3) / 3 - middle[..., None] * (x**2 - begin**2) / 2
    area = np.diff(np.stack([x - begin, slant], axis=2))
    moment = np.diff(np.stack([(x**2 - begin**2) / 2, cubes / wide], axis=2))
    centre = (np.arange(count) + 0.5) / count
    return np.stack([area * count, 12 * (moment - centre * area) * count**2], axis=-1)
