"""What has to be done to a measured log before its rows are states of a simulator."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pandas as pd

from simgap_files.atomic import atomic_write_text
from sims.simulator import Array


def sum_accelerations(source: str | Path, target: str | Path) -> None:
    """Sum an accelerometer's log up to velocities, for ``FallingPhone``.

    The start speed of a trial is not in the log; it is taken as zero, which is nearly true for a
    phone that was dropped and wrong for one that was thrown.

    Args:
        source: CSV with columns kind, trial, t in s and az in m/s^2, zero in free fall.
        target: CSV to write, with the column velocity in m/s in place of az.
    """
    table = pd.read_csv(source)
    trials = []
    for _, trial in table.groupby(["kind", "trial"], sort=False):
        steps = np.diff(trial["t"])
        middle = 0.5 * (trial["az"].to_numpy()[1:] + trial["az"].to_numpy()[:-1])
        felt = np.concatenate([[0.0], np.cumsum(steps * middle)])
        trials.append(trial.assign(velocity=felt - 9.8 * (trial["t"] - trial["t"].iloc[0])))
    columns = ["kind", "trial", "t", "velocity"]
    atomic_write_text(target, pd.concat(trials)[columns].to_csv(index=False))


def cut_coast(
    source: str | Path, target: str | Path, mass: float, radius: float, burn_time: float
) -> None:
    """Cut the coast out of a rocket's altimeter log, for ``CoastingRocket``.

    From 1.2 s after burn-out and from where the speed is below 230 m/s (near the speed of sound a
    barometer lies) to 1.5 s before the end.

    Args:
        source: CSV with columns t in s from lift-off and altitude in m.
        target: CSV to write; besides there are the columns area_per_mass in m^2/kg and speed in
            m/s, the slope of the altitude over 2.1 s.
        mass: After burn-out, in kg.
        radius: Of the body, in m.
        burn_time: In s.
    """
    table = pd.read_csv(source)
    times, altitude = table["t"].to_numpy(float), table["altitude"].to_numpy(float)
    speed = local_slope(times, altitude, 2.1)
    late = (times >= burn_time + 1.2) & (times <= times[-1] - 1.5)
    too_fast = np.flatnonzero(late & (speed >= 230.0))
    if too_fast.size:
        late[: too_fast[-1] + 1] = False
    coast = table.assign(area_per_mass=math.pi * radius**2 / mass, speed=speed)[late]
    atomic_write_text(target, coast.to_csv(index=False))


def local_slope(times: Array, values: Array, width: float) -> Array:
    """Rate of change at every sample: the slope of a quadratic fitted over ``width`` seconds.

    Args:
        times: In s, increasing, shape (n,).
        values: shape (n,), finite.
        width: Of the neighbourhood; it holds five samples at least.

    Returns:
        shape (n,), in units of ``values`` per s.
    """
    slopes = np.empty(len(times))
    for k, now in enumerate(times):
        low = np.searchsorted(times, now - width / 2)
        high = np.searchsorted(times, now + width / 2, side="right")
        low, high = max(0, min(low, k - 2)), min(len(times), max(high, k + 3))
        near = times[low:high] - now
        slopes[k] = np.polynomial.polynomial.polyfit(near, values[low:high], 2)[1]
    return slopes
