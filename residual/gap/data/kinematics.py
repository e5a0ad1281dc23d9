"""Whether positions and their measured rates are on one scale, and tell of one time."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.logs.checks import Finding
from residual.logs.faults import rounding
from residual.trajectories import Trajectory
from sims.host import HostSimulator

Array = NDArray[np.float64]


#: Values of a position that tell nothing of a scale.
FEW = 8
#: Part of what a position moves by, squared, that its rate on another scale may leave: sensors of
#: one motion leave less, whatever their noise.
OTHER = 0.25
#: Sampling steps by which a rate may be early or late for the way in which it was computed.
LATE = 0.75


def kinematics(
    simulator: HostSimulator, trajectories: Sequence[Trajectory]
) -> tuple[list[Trajectory], list[Finding]]:
    """Compare the change of each position with the integral of its measured rate.

    A rate on another scale than its position is a fault of the log, not of the simulator; left
    alone it would be taken for missing physics. It is put on the position's scale, and a sensor
    that is late beside the other on the other's time: no sensor is early.

    Args:
        simulator: Gives the channels.
        trajectories: Measured runs.

    Returns:
        The runs, corrected where needed, and what was found.
    """
    channels = simulator.physical_channels
    names = [channel.name for channel in channels]
    runs, findings = list(trajectories), []
    for column, channel in enumerate(channels):
        if channel.kind != "rate" or channel.rate_of not in names:
            continue
        position = names.index(channel.rate_of)
        seen = _Stretches.of(runs, position, column)
        if seen is None:
            continue
        (scale, error), (other, _) = seen.scale(seen.integral), seen.scale(seen.roughly)
        # Two rules that disagree say that the sampling is too coarse for this check.
        agree = abs(scale - other) < 0.25 * abs(scale - 1)
        clear = abs(scale - 1) > max(4 * error, 0.005)
        sound = agree and clear and seen.follows(scale)
        if sound and not (seen.by_zero(scale, error) or seen.by_noise):
            says = (
                f"changes {scale:.4f} times as much as the integral of {channel.name}: "
                f"{channel.name} was multiplied by {scale:.4f}; if it is {channel.rate_of} that "
                "reads wrongly, both do now, and if it is the clock, whatever has a time in its "
                "unit is off by as much"
            )
            numbers = {"scale": scale}
            findings.append(Finding("kinematics", channel.rate_of, says, numbers, "warning"))
            runs = [_multiplied(run, column, scale) for run in runs]
        (late, error), (other, _) = seen.late(seen.integral), seen.late(seen.roughly)
        least = max(5 * error, LATE * seen.step)
        if abs(late) > least and abs(late - other) < 0.25 * abs(late):
            findings.append(_late(channel.rate_of, channel.name, late))
            behind = position if late > 0 else column
            runs = [earlier(run, behind, abs(late)) for run in runs]
    return runs, findings


def _late(position: str, rate: str, late: float) -> Finding:
    """That one of two sensors of one motion is late."""
    behind, ahead = (position, f"the integral of {rate}") if late > 0 else (rate, position)
    says = (
        f"comes {abs(late):.2g} s after {ahead}: its sensor is late or filtered, which no effect "
        "of the library is; it was taken to be so much earlier. If the other one is wrong, leave "
        "that out"
    )
    return Finding("late", behind, says, {"seconds": abs(late)}, "warning")


@dataclasses.dataclass(frozen=True)
class _Stretches:
    """What a position and its rate do in stretches of eight steps.

    Attributes:
        moved: Change of the position.
        integral: Of the rate, by Simpson's rule; ``roughly``, by trapezoids.
        faster: Change of the rate.
        of_position, of_rate: Variances of their noise.
        step: Seconds between two samples.
    """

    moved: Array
    integral: Array
    roughly: Array
    faster: Array
    of_position: float
    of_rate: float
    step: float

    @classmethod
    def of(cls, runs: Sequence[Trajectory], position: int, rate: int) -> _Stretches | None:
        """None if there are too few of them, or readings, to tell anything."""
        rows, noises = [], []
        seen = np.concatenate([run.states[:, position] for run in runs])
        if len(np.unique(seen[np.isfinite(seen)])) < FEW:
            return None
        for run in runs:
            x, v = run.states[:, position], run.states[:, rate]
            for a in range(0, len(run) - 7, 8):
                part = slice(a, a + 9)
                if np.isfinite(x[part]).all() and np.isfinite(v[part]).all():
                    times, q, dq = run.times[part], x[part], v[part]
                    integrals = _simpson(dq, times), float(np.trapezoid(dq, times))
                    rows.append((q[-1] - q[0], *integrals, dq[-1] - dq[0]))
                    noises.append((_roughness(q, times), _roughness(dq, times)))
        if len(rows) < 10:
            return None
        of_x, of_v = np.median(np.array(noises), axis=0)
        # Where most readings repeat, a cubic leaves nothing, and rounding is all their noise.
        of_x = max(of_x, rounding([run.states[:, position] for run in runs]) ** 2 / 12)
        of_v = max(of_v, rounding([run.states[:, rate] for run in runs]) ** 2 / 12)
        step = float(np.median([np.median(run.durations) for run in runs]))
        moved, integral, roughly, faster = np.array(rows).T
        return cls(moved, integral, roughly, faster, of_x, of_v, step)

    @property
    def by_noise(self) -> bool:
        """Whether both may be on one scale, if all that scatters is noise of one of them: how much
        each has is told by what is rough, which a filter takes out, and coloured noise is not."""
        y, z = self.moved, self.integral
        both = float(y @ z)
        low, high = both / max(float(z @ z), 1e-300), float(y @ y) / (both or 1e-300)
        return low <= 1.0 <= high

    def by_zero(self, scale: float, error: float) -> bool:
        """Whether a scale is that of a rate whose zero is off, so that another one is found of how
        stretches differ."""
        centred = dataclasses.replace(self, moved=self.moved - self.moved.mean())
        own, its = centred.scale(self.integral - self.integral.mean())
        apart = max(4 * float(np.hypot(error, its)), 0.25 * abs(scale - 1))
        return bool(np.isfinite(its) and abs(own - scale) > apart)

    def follows(self, scale: float) -> bool:
        """Whether the position does what the rate says on that scale: columns of something else
        have a scale, too."""
        left = self.moved - scale * self.integral
        return bool(scale > 0 and left @ left < OTHER * (self.moved @ self.moved))

    def scale(self, z: Array) -> tuple[float, float]:
        """Change of the position per integral of the rate, with its standard error."""
        y = self.moved
        # Variance of the change (two readings) and of the integral (eight steps of readings).
        in_y = max(2 * self.of_position, 1e-300)
        in_z = max(8 * self.step**2 * self.of_rate, 1e-300)
        if z @ z < 4 * len(z) * in_z:
            return np.nan, np.inf
        scale = _through_origin(z, y, in_y / in_z)
        left = y - scale * z
        # Both have noise, so the part of the residual that belongs to z goes back to it.
        cleaned = z + left * scale * in_z / (in_y + scale**2 * in_z)
        return scale, float(np.linalg.norm(left * cleaned) / (cleaned @ cleaned))

    def late(self, integral: Array) -> tuple[float, float]:
        """Seconds by which the position comes after the integral of its rate, with their error.

        A position that comes T late lacks T times by how much the rate grew. Noise of the rate
        makes it look less late than it is.
        """
        y, both = self.moved, np.stack([integral, self.faster], axis=1)
        if self.faster @ self.faster < 8 * len(y) * self.of_rate:
            return np.nan, np.inf
        found, *_ = np.linalg.lstsq(both, y, rcond=None)
        inverse = np.linalg.pinv(both.T @ both)
        left = (y - both @ found)[:, None] * both
        return -float(found[1]), float(np.sqrt((inverse @ (left.T @ left) @ inverse)[1, 1]))


def _through_origin(z: Array, y: Array, ratio: float) -> float:
    """Slope of y = slope z with noise in both, ``ratio`` of their variances.

    Least squares alone would take noise in z for a smaller slope. Source: Deming, "Statistical
    adjustment of data" (1943), without the constant.
    """
    yy, zz, zy = float(y @ y), float(z @ z), float(z @ y)
    rest = yy - ratio * zz
    return (rest + np.sqrt(rest**2 + 4 * ratio * zy**2)) / (2 * zy)


def _roughness(values: Array, times: Array) -> float:
    """Variance of what a cubic in time leaves."""
    basis = np.vander((times - times.mean()) / max(float(np.ptp(times)), 1e-12), 4)
    rest = values - basis @ np.linalg.lstsq(basis, values, rcond=None)[0]
    return float(rest @ rest) / (len(values) - 4)


def _simpson(values: Array, times: Array) -> float:
    steps = np.diff(times)
    if np.ptp(steps) > 0.05 * steps.mean():
        return float(np.trapezoid(values, times))
    weights = np.array([1, 4, 2, 4, 2, 4, 2, 4, 1]) / 3
    return float(steps.mean() * (weights @ values))


def _multiplied(run: Trajectory, column: int, factor: float) -> Trajectory:
    states = np.array(run.states, float)
    states[:, column] *= factor
    return dataclasses.replace(run, states=states)


def earlier(run: Trajectory, column: int, seconds: float) -> Trajectory:
    """The same with a channel as it is read so much later, straight from reading to reading; what
    lies beyond the last one, or in a gap of readings, is missing."""
    states = np.array(run.states, float)
    there = np.isfinite(states[:, column])
    if there.any():
        at, read = run.times + seconds, run.times[there]
        moved = np.interp(at, read, states[there, column], right=np.nan)
        gap = np.diff(read, append=np.inf)[np.searchsorted(read, at, side="right") - 1]
        states[:, column] = np.where(gap > 2.5 * np.median(run.durations), np.nan, moved)
    return dataclasses.replace(run, states=states)
