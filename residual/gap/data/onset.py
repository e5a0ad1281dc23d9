"""Records whose motion begins late: a drive that was switched on, or a body let go, unlogged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.at_rest import begins_on, largest
from residual.gap.data.inspection import measured
from residual.logs.checks import Finding
from residual.logs.faults import noise, rounding
from residual.trajectories import Trajectory
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: Samples for which a record has to stand still, and a part of an input that is no change of it.
STANDS, CHANGED = 5, 0.02
#: Standard deviations of the noise within which a channel stands.
NOISY = 6.0
#: Times as far as noise or rounding go, from which on something clearly moved.
CLEAR = 10.0
#: Times as long as the usual time that motion takes to follow its input.
LATER = 3.0
#: Part of the largest speed of the first samples up to which the first one tells of rest.
GATHERS = 0.7
#: Control periods for which the simulator is asked whether it moves.
MOST = 5000


@dataclass(frozen=True)
class _Beginning:
    """How a record begins.

    Attributes:
        onset: Last row at which all that is measured stands where it stood at first.
        since: Row at which the inputs took the values that they have then.
        waits: Seconds from there to the onset.
        driven: Whether an input is on then, or changed.
        rests: Whether it is at rest at first, and not in the middle of some motion.
    """

    onset: int
    since: int
    waits: float
    driven: bool
    rests: bool


def begun_late(
    simulator: HostSimulator, trajectories: Sequence[Trajectory]
) -> tuple[list[Trajectory], list[Finding]]:
    """Leave out the samples at which a record stands still until something unlogged happens.

    At rest under inputs that do not change nothing that has no memory begins to move. Where the
    simulator says that it would have moved at once, a log that shows motion later tells of a
    switch or a hand, and friction or a dead zone would be made of it. An input with a delay makes
    all records wait alike, so that one in which an input is on counts as late beside others only.

    Args:
        simulator: The nominal one.
        trajectories: Measured runs.

    Returns:
        The runs, each from the last sample before its motion on, and what was left out.
    """
    runs = list(trajectories)
    if simulator.has_contacts:
        return runs, []
    bands, least = _bands(simulator, runs), CHANGED * largest(simulator, runs)
    on = begins_on(simulator, runs)
    begins = [_beginning(*one, bands, least) for one in zip(runs, on, strict=True)]
    late = [
        begin is not None
        and begin.onset - begin.since >= STANDS
        and begin.waits > LATER * (float(np.median(run.durations)) + _usual(begin, begins))
        and _abrupt(run, begin, bands)
        and _would_move(simulator, run, begin, bands)
        for run, begin in zip(runs, begins, strict=True)
    ]
    left = [
        run.piece(begin.onset, len(run.times)) if gone and begin else run
        for run, begin, gone in zip(runs, begins, late, strict=True)
    ]
    return left, _told(runs, begins, late)


def _usual(begin: _Beginning, begins: Sequence[_Beginning | None]) -> float:
    """Seconds for which other records wait that are driven from rest; 0 if this one is not."""
    if not begin.driven:
        return 0.0
    others = [b.waits for b in begins if b is not None and b is not begin and b.driven and b.rests]
    return float(np.median(others)) if len(others) > 1 else np.inf


def _bands(simulator: HostSimulator, runs: Sequence[Trajectory]) -> Array:
    """How far every channel goes from where it stands by noise and rounding; inf if unmeasured."""
    bands = np.full(len(simulator.physical_channels), np.inf)
    names = [channel.name for channel in simulator.physical_channels]
    for channel, values in measured(simulator, runs):
        # Of the first samples too: motion later on is no noise.
        each = [min(noise([own]), noise([own[: 4 * STANDS + 2]])) for own in values]
        span = float(np.nanmax(np.concatenate(values)) - np.nanmin(np.concatenate(values)))
        least = max(1.01 * rounding(values), 1e-4 * span)
        bands[names.index(channel.name)] = max(NOISY * float(np.median(each)), least)
    return bands


def _beginning(run: Trajectory, on: bool, bands: Array, least: Array) -> _Beginning | None:
    """How a record begins; None if nothing in it moves.

    Args:
        run: The record.
        on: Whether an input is on as it begins.
        bands: How far every channel goes where it stands.
        least: Change of every input that is one.
    """
    away = np.abs(run.states - run.states[0]) > bands
    # Twice in a row, so that a wild sample is no motion.
    moves = np.flatnonzero(away[:-1].any(axis=1) & away[1:].any(axis=1))
    if not moves.size:
        return None
    onset = int(moves[0]) - 1
    # From what they are then, not from row to row: a slow ramp changes, too.
    others = np.abs(run.actions[: onset + 1] - run.actions[onset]) > least
    changed = np.flatnonzero(others.any(axis=1))
    since = int(changed[-1]) + 1 if changed.size else 0
    waits = float(run.times[onset] - run.times[since])
    return _Beginning(onset, since, waits, on or since > 0, onset > 0 or _gathers(run, away[1]))


def _gathers(run: Trajectory, moves: NDArray[np.bool_]) -> bool:
    """Whether what moves from the first sample on moves faster soon after."""
    speeds = np.abs(np.diff(run.states[: STANDS + 1, moves], axis=0)) / run.durations[:STANDS, None]
    return bool((speeds[0] < GATHERS * np.nanmax(speeds, axis=0)).all())


def _abrupt(run: Trajectory, begin: _Beginning, bands: Array) -> bool:
    """Whether motion is clear soon after it shows at all: no slow start that a coarse sensor hides.

    What grows by the fifth power of time, or less, from the input's change on does not go ten
    times as far in one and a half times the time.
    """
    soon = run.times[begin.onset] + 0.5 * begin.waits
    after = run.states[begin.onset : np.searchsorted(run.times, soon, side="right")]
    return bool((np.abs(after - run.states[0]) > CLEAR * bands).any())


def _would_move(simulator: HostSimulator, run: Trajectory, begin: _Beginning, bands: Array) -> bool:
    """Whether the simulator, at rest where the record stands, moves clearly while that waits."""
    channels = simulator.physical_channels
    rates = [channel.kind == "rate" and channel.rate_of is not None for channel in channels]
    still = np.where(rates, 0.0, run.states[0])
    if not np.isfinite(still).all():
        return False
    action = run.actions[[begin.since]]
    steps = min(int(np.ceil(begin.waits / simulator.dt)), MOST)
    start = simulator.augment(still[None], action)
    with np.errstate(all="ignore"):
        path = simulator.rollout(start, np.repeat(action[None], steps, axis=1))[0]
    return bool((np.abs(path[-1, : len(channels)] - still) > CLEAR * bands).any())


def _told(
    runs: Sequence[Trajectory], begins: Sequence[_Beginning | None], late: Sequence[bool]
) -> list[Finding]:
    """What was left out."""
    waits = [(run, one) for run, one, gone in zip(runs, begins, late, strict=True) if gone and one]
    if not waits:
        return []
    run, begin = waits[0]
    more = f" (and {len(waits) - 1} more so)" if len(waits) > 1 else ""
    before = f"stands still for {begin.waits:.3g} s"
    if run.actions.any():
        happens = f"{before} under inputs that move its simulator, then moves though none changed"
        cause = "switched on, or let go, late"
    else:
        happens, cause = f"{before} where its simulator moves, then moves", "let go late"
    says = f"{happens}{more}: {cause}? What comes before, {begin.onset} samples, is left out"
    numbers = {"seconds": begin.waits, "samples": float(begin.onset)}
    return [Finding("onset", run.name, says, numbers, "warning")]
