"""What is compared: the error of forecasts, in units of what the nominal simulator makes of them.

0 is perfect, 1 as bad as the nominal simulator. Errors of a channel are summed over blocks, the
channels of one joint (its position and its rate) are averaged, and then all joints, each weighed
by the part of its error that noise alone would not make.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sims.simulator import Channel

Array = NDArray[np.float64]


#: Squared error over that by noise alone, below which a joint shows no gap.
NOISY = 1.3
#: Blocks, counted by what is at stake in them, below which one of them decides alone.
ALONE = 2.0
#: Part of the error that all blocks but one have to hold to be asked alone, and of that part what
#: one of them holds in which an effect acts.
REST, TOUCHED = 0.1, 0.01


def groups(channels: Sequence[Channel]) -> tuple[tuple[int, ...], ...]:
    """Positions in a list of measured channels that belong to one joint."""
    found: dict[str, list[int]] = {}
    for place, channel in enumerate(channels):
        found.setdefault(channel.rate_of or channel.name, []).append(place)
    return tuple(tuple(places) for places in found.values())


@dataclasses.dataclass(frozen=True)
class Currency:
    """Turns mean squared errors of blocks into relative errors.

    Attributes:
        nominal: Of the nominal simulator, (B, m).
        groups: Channels that count as one.
        weights: Weight of each group in the mean of all; alike by default.
    """

    nominal: Array
    groups: tuple[tuple[int, ...], ...]
    weights: tuple[float, ...] = ()

    def only_where_wrong(self, floor: Array) -> Currency:
        """The same without joints at which the nominal simulator errs no more than noise does, and
        less of those at which it errs little more.

        What moves there is noise, and a force that calms it would pass for physics. A joint that
        errs by a third more than noise has next to no gap, and what is left of that is no half of
        the whole.

        Args:
            floor: Mean squared errors of blocks if only noise were left, (B, m).
        """
        times = np.nanmean(self.nominal, axis=0) / np.maximum(np.nanmean(floor, axis=0), 1e-300)
        kept = tuple(g for g in self.groups if (times[list(g)] > NOISY).any())
        beyond = tuple(float(1 - 1 / np.sqrt(np.nanmax(times[list(g)]))) for g in kept)
        return dataclasses.replace(self, groups=kept or self.groups, weights=beyond)

    def averaged(self, by_group: Array) -> Any:
        """Mean over groups, the last axis, by their weights."""
        return np.average(by_group, axis=-1, weights=self.weights or None)

    def by_block(self, squares: Array) -> Array:
        """Share of every block and group in the relative error, (B, g); sums over B are errors."""
        weights = np.sqrt(self.nominal) / np.maximum(np.nansum(self.nominal, axis=0), 1e-300)
        shares = np.nan_to_num(np.sqrt(squares) * weights)
        return np.stack([shares[:, list(group)].mean(axis=1) for group in self.groups], axis=1)

    def in_blocks(self, squares: Array) -> Array:
        """The same, all groups averaged, (B,)."""
        shares: Array = self.averaged(self.by_block(squares))
        return shares

    def by_group(self, squares: Array) -> Array:
        """Relative error of every group, (g,)."""
        return self.by_block(squares).sum(axis=0)

    def error(self, squares: Array) -> float:
        """Relative error, all groups averaged."""
        return float(self.averaged(self.by_group(squares)))

    def difference(self, one: Array, other: Array, group: int | None = None) -> tuple[float, float]:
        """Relative error of one less that of another, and its standard error over blocks."""
        change = self.by_block(one) - self.by_block(other)
        per_block = self.averaged(change) if group is None else change[:, group]
        n = len(per_block)
        spread = float(per_block.std(ddof=1) * np.sqrt(n)) if n > 1 else np.inf
        return float(per_block.sum()), spread

    def clearly(self, one: Array, other: Array, group: int, by_stake: bool = False) -> float:
        """Standard errors by which one set is worse than another, block by block.

        Ratios of the blocks' errors are compared, weighed by what is at stake: blocks are driven
        unequally hard, so that differences would have the spread of the drive.

        Args:
            one, other: Mean squared errors of blocks, (B, m).
            group: The joint that is looked at.
            by_stake: Count blocks by what is at stake in them, so that no single one decides.
        """
        a, b = (self.by_block(squares)[:, group] for squares in (one, other))
        there = (a > 0) & (b > 0)
        if there.sum() < 3:
            return 0.0
        ratios, weights = np.log(a[there] / b[there]), a[there] / a[there].sum()
        mean = float(weights @ ratios)
        n = 1 / float((weights**2).sum()) if by_stake else float(there.sum())
        if n < ALONE:
            return 0.0
        error = float(np.sqrt((weights**2) @ (ratios - mean) ** 2 * n / (n - 1)))
        return mean / max(error, 1e-12)

    def clearly_elsewhere(self, one: Array, other: Array, group: int) -> float:
        """The same without the block in which most is at stake, all others in which something is
        counting alike.

        Returns:
            Standard errors; 0 if there are fewer than three, or nearly nothing is at stake there.
        """
        a, b = (self.by_block(squares)[:, group] for squares in (one, other))
        rest = np.delete(a, np.argmax(a))
        there = (a > TOUCHED * rest.sum()) & (a < a.max()) & (b > 0)
        if there.sum() < 3 or rest.sum() < REST * a.sum():
            return 0.0
        ratios = np.log(a[there] / b[there])
        error = float(ratios.std(ddof=1) / np.sqrt(len(ratios)))
        return float(ratios.mean()) / max(error, 1e-12)

    def share(
        self, less: Array, more: Array, rng: np.random.Generator
    ) -> tuple[float, float, float]:
        """Part of the nominal squared error that lies between two sets, with a 95 % interval.

        Args:
            less, more: Mean squared errors of blocks, (B, m), without and with something.
            rng: Draws blocks for the interval.
        """
        n = len(self.nominal)
        picks = np.vstack([np.arange(n)[None], rng.integers(0, n, (400, n))])
        base = np.maximum(np.nan_to_num(self.nominal)[picks].sum(axis=1), 1e-300)
        gained = np.nan_to_num(less - more)[picks].sum(axis=1) / base
        drawn = self.averaged(np.stack([gained[:, list(g)].mean(1) for g in self.groups], axis=1))
        low, high = np.quantile(drawn[1:], [0.025, 0.975])
        return float(drawn[0]), float(min(low, drawn[0])), float(max(high, drawn[0]))
