"""How far forecasts go if the user does not say: far enough to see, short enough to repeat."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.fitting.smooth import LEAD
from residual.trajectories import Trajectory
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: Spread of an angle that turns and turns.
TURNING = np.pi / np.sqrt(3)
#: Part of the usual period of the motion.
PART = 1 / 3
#: Part of a length asked for by which another is none.
NEARLY = 0.2
#: Times that the mean square of differences is over twice the time where motion makes them (four
#: where it is steady, two where it jumps, one of noise), and part of the variance up to which it
#: may be that of noise.
FARTHER, LITTLE = 1.5, 0.5
#: Windows that the records should at least be good for, and where so many show nothing.
WINDOWS, FEWER = 8, 5
#: Parts of a length by which it is cut until the records hold the windows that they should.
SHORTER = np.linspace(1.0, 0.5, 51)
#: Least samples of a window, and of a forecast of a system that strikes the ground.
SAMPLES, STRIDE = 8, 10


def usual_horizon(
    simulator: HostSimulator, trajectories: Sequence[Trajectory], windows: int = WINDOWS
) -> float:
    """A third of the usual period of the motion, or less if the records are short, in s.

    Two thirds of a system that strikes the ground: its forecasts begin where a shorter window
    ends, and over less a small force moves nothing.

    The period is that of a sine with the same spread and the same spread of its rate, the middle
    one over channels. At least the records have to hold some windows of ``SAMPLES`` samples.

    Args:
        simulator: Gives the channels and the control period.
        trajectories: Measured runs.
        windows: How many the records have to hold.
    """
    step = float(np.median(np.concatenate([t.durations for t in trajectories])))
    periods = []
    for column, channel in enumerate(simulator.physical_channels):
        if channel.kind == "rate" and any(
            np.isfinite(t.states[:, i]).any()
            for t in trajectories
            for i, other in enumerate(simulator.physical_channels)
            if other.name == channel.rate_of
        ):
            continue
        period = _period(trajectories, column, channel.angle)
        if np.isfinite(period):
            periods.append(period)
    part = 2 * PART if simulator.has_contacts else PART
    wanted = part * float(np.median(periods)) if periods else 20 * simulator.dt
    most = longest_horizon(trajectories, windows)
    least = STRIDE if simulator.has_contacts else (1 - LEAD) * SAMPLES
    return float(max(min(wanted, most), least * step))


def held_by_records(
    simulator: HostSimulator, trajectories: Sequence[Trajectory], asked: float
) -> float:
    """A length asked for, or what the longest record can hold if that is less, in s.

    Rows are chosen for it: for more than there is they would be too far apart to see the motion.
    """
    longest = longest_horizon(trajectories, 1)
    return min(asked, longest / (1 - LEAD) if simulator.has_contacts else longest)


def other_length(simulator: HostSimulator, asked: float, seconds: float) -> list[str]:
    """What is to be said if forecasts are not as long as a user asked for.

    Args:
        simulator: If it strikes the ground, lead-ins do not count.
        asked: Length asked for in s.
        seconds: What they last in s.
    """
    lead = 0.0 if simulator.has_contacts else asked * LEAD / (1 - LEAD)
    if abs(seconds - lead - asked) <= NEARLY * asked:
        return []
    why = (
        "the samples are too far apart for less, or records hold no whole number of it"
        if seconds > asked + lead
        else "records are too short for more, or motion is too unstable"
    )
    return [
        f"a horizon of {asked:.3g} s was asked for, and forecasts last {seconds:.3g} s"
        f"{' with their lead-in' if lead else ''}: {why}"
    ]


def longest_horizon(trajectories: Sequence[Trajectory], windows: int = WINDOWS) -> float:
    """The longest of which the records still hold so many windows, in s.

    Every record is divided evenly, so that of six alike eight windows ask for two in each.
    """
    lengths = np.array([t.times[-1] - t.times[0] for t in trajectories])
    most = min(float(lengths.sum()) / windows, float(lengths.max()))

    def held(length: float) -> float:
        # Of a thinned log the last rows of a record may be lost.
        return float(np.maximum(np.round(0.95 * lengths / length), 1).sum())

    shorter = (share * most for share in SHORTER if held(share * most) >= windows)
    return (1 - LEAD) * next(shorter, most)


def _period(trajectories: Sequence[Trajectory], column: int, angle: bool) -> float:
    """Of a sine that moves as far and as fast as a channel, NaN if it stands still."""
    records = []
    for run in trajectories:
        known = np.isfinite(run.states[:, column])
        if known.sum() >= 8:
            records.append((run.states[known, column], run.times[known]))
    if not records:
        return float("nan")
    most = TURNING if angle else np.inf
    sizes = np.array([len(values) for values, _ in records], float)
    stds = np.minimum([values.std() for values, _ in records], most)
    spread = float(np.sqrt((sizes * stds**2).sum() / sizes.sum()))
    speeds = [_speed(values, times, spread) for values, times in records]
    speed = float(np.sqrt((sizes * np.square(speeds)).sum() / sizes.sum()))
    if speed <= 0 or spread <= 0:
        return float("nan")
    return 2 * np.pi * spread / speed


def _speed(values: Array, times: Array, spread: float) -> float:
    """Root mean square rate of a channel: from differences over which it moves a quarter of its
    spread, less what noise adds to differences of any length. Samples may come in bursts."""
    lag = _lag(values, spread)
    longer = min(2 * lag, len(values) - 1)
    once, twice = _change(values, lag), _change(values, longer)
    short, long = _change(times, lag), _change(times, longer)
    # With noise s: (v t)^2 + 2 s^2 for both times t.
    square = (twice - once) / (long - short) if twice > once else once / short
    return float(np.sqrt(square))


def _lag(values: Array, spread: float) -> int:
    """Samples over which a channel moves a quarter of its spread; where noise does, which is less
    than the motion, those from which on it moves clearly farther the longer it has time."""
    lag = 1
    while 4 * lag < len(values) and _change(values, lag) < (0.25 * spread) ** 2:
        lag *= 2
    if _change(values, lag) > LITTLE * spread**2:
        return lag
    longer = lag
    while 8 * longer < len(values):
        once, twice, again = (_change(values, times * longer) for times in (1, 2, 4))
        if twice >= FARTHER * once and again >= FARTHER * twice:
            return longer
        longer *= 2
    return lag


def _change(values: Array, lag: int) -> float:
    """Mean squared difference over so many samples."""
    return float(np.mean((values[lag:] - values[:-lag]) ** 2))
