"""Episodes that follow each other in one record, times going on: a position or a first-order state
leaps from one row to the next, and moves on from there.

No force does that to a position, and to a state nothing that the simulator knows. What was begun
anew, or moved by hand between two rows, is another record.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.nominal import filled
from residual.gap.data.turns import wrapped
from residual.logs.checks import Finding
from residual.logs.faults import dropped_samples, grain
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
#: Times the most that the simulator moves a state in a row that a leap of it is.
BEYOND = 5.0
#: Rows on either side of a leap in which a step of an input may have caused it, part of the input's
#: range that a step is, and others as large as half of it, without a leap, by which it did not.
NEAR, STEP, OTHERS = 3, 0.05, 2
#: Rows below which a piece is no record.
LEAST = 5


def _received(runs: Sequence[Array], turn: float) -> list[Array]:
    """Values with a straight line where a reading was not received: no leap goes there and back."""
    filled = []
    for values, lost in zip(runs, dropped_samples(runs, turn), strict=True):
        rows = np.arange(len(values))
        line = np.interp(rows[lost], rows[~lost], values[~lost])
        filled.append(np.array(values))
        filled[-1][lost] = line
    return filled


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
    leaping = []
    turning_over = {finding.where for finding in wrapped(simulator, trajectories)}
    for column, channel in enumerate(channels):
        if channel.name in turning_over:
            continue
        turning = 2 * np.pi if channel.angle else np.inf
        values = [run.states[:, column] for run in trajectories]
        values = _received(values, turning if channel.angle else 0.0)
        if channel.kind == "position" and channel.name in rate_of:
            rates = [run.states[:, rate_of[channel.name]] for run in trajectories]
            measured = any(np.isfinite(own).any() for own in rates)
            found = leapt(values, times, rates if measured else None, turning)
        elif channel.rate_of is None and not simulator.has_contacts:
            found = leapt(values, times, None, turning)
            if any(own.any() for own in found):
                found = _unmoved(simulator, trajectories, column, found)
        else:
            continue
        leaping += [channel.name] if any(own.any() for own in found) else []
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
        when = f"at {first}" if count == 1 else f"{count} times, the first time at {first},"
        what = " and ".join(leaping) if len(leaping) < 3 else "the state"
        says = (
            f"{run.name} begins anew {when} without saying so: {what} leaps there, as nothing "
            "moves it from one row to the next; it was cut there"
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
    moved = max(FAST * usual if rates is None else 0.0, SUDDEN * sudden)
    least = max(FAR * min(float(np.ptp(known)), most), ROUGH * grain(values))
    period = float(np.median(np.concatenate(steps)))
    for own, leap, step, mask in zip(values, beyond, steps, found, strict=True):
        # Over a hole it moves farther.
        own_least = np.maximum(moved * np.maximum(step / period, 1.0), least)
        for row in np.flatnonzero(np.abs(leap) > own_least).tolist():
            mask[row] = not (_comes_back(leap, row) or _held(own, row))
    return found


def _unmoved(
    simulator: HostSimulator, trajectories: Sequence[Trajectory], column: int,
    leaps: Sequence[NDArray[np.bool_]],
) -> list[NDArray[np.bool_]]:  # fmt: skip
    """Leaps of a state that neither what the simulator knows nor a step of an input makes."""
    most, inputs = 0.0, [run.actions for run in trajectories]
    for run in trajectories:
        states = filled(simulator, run)
        if states is None:
            return [np.zeros_like(own) for own in leaps]
        rows = np.flatnonzero(np.isfinite(states[:-1]).all(axis=1))
        actions = run.actions[rows]
        with np.errstate(all="ignore"):
            after = simulator.step(simulator.augment(states[rows], actions), actions)[:, column]
        pace = np.abs(after - states[rows, column]) / simulator.dt * run.durations[rows]
        most = max(most, float(np.max(pace, initial=0.0, where=np.isfinite(pace))))
    caused = _caused(inputs, leaps)
    return [
        own & (np.abs(np.diff(run.states[:, column])) > BEYOND * most) & ~by
        for own, by, run in zip(leaps, caused, trajectories, strict=True)
    ]


def _caused(inputs: Sequence[Array], leaps: Sequence[NDArray[np.bool_]]) -> list[NDArray[np.bool_]]:
    """Leaps beside a step of an input, unless other steps as large bring none."""
    caused = [np.zeros_like(own) for own in leaps]
    near = [_beside(own) for own in leaps]
    for column in range(inputs[0].shape[1]):
        stepped = [np.abs(np.diff(own[:, column], prepend=own[:1, column])) for own in inputs]
        least = STEP * float(np.ptp(np.concatenate([own[:, column] for own in inputs])))
        for own, step, by in zip(leaps, stepped, caused, strict=True):
            for row in np.flatnonzero(own):
                size = float(step[max(row - NEAR, 0) : row + NEAR + 1].max())
                others = sum(
                    int((one[~beside] > size / 2).sum())
                    for one, beside in zip(stepped, near, strict=True)
                )
                by[row] |= size > least and others < OTHERS
    return caused


def _beside(leaps: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Rows near a leap."""
    near = np.zeros_like(leaps)
    for row in np.flatnonzero(leaps):
        near[max(row - NEAR, 0) : row + NEAR + 1] = True
    return near


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
