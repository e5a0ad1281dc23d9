"""Episodes that follow each other in one record, times going on: a position leaps from one row to
the next, and moves on from there.

No force does that. What was begun anew, or moved by hand between two rows, is another record.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.logs.checks import Finding
from residual.logs.faults import grain
from residual.trajectories import Trajectory, moment
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: Part of the rows that move as usual.
USUAL = 0.9
#: Times the usual way of a row, and the usual change of pace, that a leap is beyond the pace
#: before and after it; part of the range that it crosses, and steps of rounding.
FAST, SUDDEN, FAR, ROUGH = 2.5, 12.0, 0.1, 3.0
#: Rows on either side that tell the pace, in which one that comes back was none, and how nearly.
BESIDE, BACK, NEARLY = 2, 3, 0.3
#: Rows below which a piece is no record.
LEAST = 5


def cut_at_resets(
    simulator: HostSimulator, trajectories: Sequence[Trajectory]
) -> tuple[list[Trajectory], list[Finding]]:
    """The runs cut where a position leaps, and what was found.

    Args:
        simulator: Gives the channels.
        trajectories: Measured runs.
    """
    channels = simulator.physical_channels
    rate_of = {channel.rate_of: i for i, channel in enumerate(channels) if channel.kind == "rate"}
    leaps = [np.zeros(len(run.actions), bool) for run in trajectories]
    times = [run.times for run in trajectories]
    for column, channel in enumerate(channels):
        if channel.kind != "position" or channel.name not in rate_of:
            continue
        values, rates = (
            [run.states[:, i] for run in trajectories] for i in (column, rate_of[channel.name])
        )
        measured = any(np.isfinite(own).any() for own in rates)
        turning = 2 * np.pi if channel.angle else np.inf
        found = leapt(values, times, rates if measured else None, turning)
        for own, mask in zip(leaps, found, strict=True):
            own |= mask
    cut: list[Trajectory] = []
    findings = []
    for run, own in zip(trajectories, leaps, strict=True):
        if not own.any():
            cut.append(run)
            continue
        edges = [0, *(np.flatnonzero(own) + 1).tolist(), len(run.times)]
        pieces = [(a, b) for a, b in itertools.pairwise(edges) if b - a >= LEAST]
        cut += [run.piece(a, b, f"{run.name} part {n}") for n, (a, b) in enumerate(pieces, start=1)]
        first = moment(float(run.times[np.flatnonzero(own)[0] + 1]))
        count = int(own.sum())
        often = "once" if count == 1 else f"{count} times"
        says = (
            f"{run.name} begins anew {often} without saying so, first at {first}: a position "
            "leaps there, and no force does that; it was cut there"
        )
        findings.append(Finding("reset", "", says, {"resets": count}, "warning"))
    return cut, findings


def leapt(
    values: Sequence[Array], times: Sequence[Array], rates: Sequence[Array] | None = None,
    most: float = np.inf,
) -> list[NDArray[np.bool_]]:  # fmt: skip
    """Steps in which a position leaps and does not come back, (n - 1,) for each run.

    Args:
        values: A position in every run, (n,).
        times: Of the rows in s, (n,).
        rates: Its rate, if that was measured; steps beside each one tell the pace, too.
        most: Range that counts if the position's is larger.
    """
    found = [np.zeros(max(len(own) - 1, 0), bool) for own in values]
    known = np.concatenate([own[np.isfinite(own)] for own in values] or [np.zeros(0)])
    if len(known) < 4 * LEAST:
        return found
    steps = [np.diff(t) for t in times]
    ways = [np.diff(own) for own in values]
    beyond = [way - _pace(way / step) * step for way, step in zip(ways, steps, strict=True)]
    if rates is not None:
        # Nearer to either: a rate that is wild tells no pace.
        by_rate = [
            w - 0.5 * (v[1:] + v[:-1]) * s for w, v, s in zip(ways, rates, steps, strict=True)
        ]
        beyond = [
            np.where(np.abs(a) < np.abs(b), a, b) for a, b in zip(by_rate, beyond, strict=True)
        ]
    if not np.isfinite(np.concatenate(beyond)).any():
        return found
    usual, sudden = (
        float(np.nanquantile(np.abs(np.concatenate(parts)), USUAL)) for parts in (ways, beyond)
    )
    least = max(
        FAST * usual if rates is None else 0.0, SUDDEN * sudden,
        FAR * min(float(np.ptp(known)), most), ROUGH * grain(values),
    )  # fmt: skip
    for own, leap, mask in zip(values, beyond, found, strict=True):
        for row in np.flatnonzero(np.abs(leap) > least).tolist():
            mask[row] = not (_comes_back(leap, row) or _held(own, row))
    return found


def _comes_back(leap: Array, row: int) -> bool:
    """Whether another leap nearby undoes this one, as that of a wild sample does."""
    beside = np.append(leap[max(row - BACK, 0) : row], leap[row + 1 : row + 1 + BACK])
    return bool((np.abs(beside + leap[row]) < NEARLY * abs(leap[row])).any())


def _held(values: Array, row: int) -> bool:
    """Whether a value is held before the leap or from it on, as by a sensor that sends zeros."""
    sides = values[max(row - BACK, 0) : row + 1], values[row + 1 : row + 2 + BACK]
    return any(len(side) == BACK + 1 and (side == side[0]).all() for side in sides)


def _pace(speeds: Array) -> Array:
    """The middle of the speeds beside every step, (n - 1,)."""
    if len(speeds) <= BESIDE:
        return speeds
    padded = np.pad(speeds, BESIDE, mode="reflect")
    beside = [padded[i : i + len(speeds)] for i in range(2 * BESIDE + 1) if i != BESIDE]
    return np.median(np.stack(beside), axis=0)
