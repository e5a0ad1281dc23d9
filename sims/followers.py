"""What follows a command with a memory of where it is: a lag, a limit of pace, a play.

Inputs run straight in each sub-step, given by mean and rise as in ``sims.drive``; outputs are lines
that keep the mean and the first moment. Each function takes

- ``means`` and ``rises``, (rows, T, substeps), and ``durations``, (T,) seconds,
- its number, scalar or (rows,); zero leaves the input as it is,
- ``start``, the output before the first sub-step of each record, (rows, records),
- ``bounds``, where each record begins, and T,

and returns means and rises of the output, and its last value, (rows,). Kernels put the former in
place of those of the input.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from sims.compiled import compiled, inlined
from sims.effects.actuator import ActuatorEffect, ActuatorLag
from sims.effects.hysteresis import Hysteresis
from sims.effects.slew import SlewLimit
from sims.simulator import Array

Integers = NDArray[np.int64]
Followed = tuple[Array, Array, Array]
#: Effects whose output follows the command, with a memory of where it is.
Follower = ActuatorLag | SlewLimit | Hysteresis


def followers(effects: Iterable[ActuatorEffect]) -> list[Follower]:
    """The effects whose output follows the command: lags, then limits of pace, then plays."""
    found = [effect for effect in effects if isinstance(effect, Follower)]
    return sorted(found, key=lambda effect: effect.stage)


def lagged(
    means: Array, rises: Array, durations: Array, time_constant: float | Array, start: Array,
    bounds: Sequence[int],
) -> Followed:  # fmt: skip
    """First-order filter, exactly; ``time_constant`` in seconds."""
    return _along(_filtered, means, rises, durations, time_constant, start, bounds)


def limited(
    means: Array, rises: Array, durations: Array, seconds_per_unit: float | Array, start: Array,
    bounds: Sequence[int],
) -> Followed:  # fmt: skip
    """An input followed at a limited pace, exactly, by what a change by one unit takes."""
    return _along(_limited, means, rises, durations, seconds_per_unit, start, bounds)


def dragged(
    means: Array, rises: Array, durations: Array, width: float | Array, start: Array,
    bounds: Sequence[int],
) -> Followed:  # fmt: skip
    """An input followed through a play of that ``width``, exactly."""
    return _along(_dragged, means, rises, durations, width, start, bounds)


def _along(
    kernel: Callable[..., Array], means: Array, rises: Array, durations: Array,
    number: float | Array, start: Array, bounds: Sequence[int],
) -> Followed:  # fmt: skip
    followed, tilted = np.array(means, float), np.array(rises, float)
    numbers = np.ascontiguousarray(np.broadcast_to(np.asarray(number, float), len(means)))
    last = kernel(
        np.ascontiguousarray(durations, float), numbers, np.ascontiguousarray(start, float),
        np.asarray(bounds, np.int64), followed, tilted,
    )  # fmt: skip
    return followed, tilted, last


@compiled
def _filtered(
    durations: Array, constants: Array, start: Array, bounds: Integers, means: Array, rises: Array
) -> Array:
    rows, length, substeps = means.shape
    y = np.empty(rows)
    for v in range(rows):
        record = 0
        for t in range(length):
            if t == bounds[record]:
                y[v] = start[v, record]
                record += 1
            ratio = durations[t] / substeps / constants[v]
            stays = np.exp(-ratio)
            share, tilt = -np.expm1(-ratio) / ratio, _tilt(ratio)
            for s in range(substeps):
                # The output follows the line at a distance, and what it lacked at first fades.
                behind = rises[v, t, s] / ratio
                first = means[v, t, s] - 0.5 * rises[v, t, s] - behind
                last = means[v, t, s] + 0.5 * rises[v, t, s] - behind
                lack = y[v] - first
                means[v, t, s] += lack * share - behind
                rises[v, t, s] += lack * tilt
                y[v] = stays * y[v] + last - first * stays
    return y


@compiled
def _limited(
    durations: Array, slow: Array, start: Array, bounds: Integers, means: Array, rises: Array
) -> Array:
    rows, length, substeps = means.shape
    y = np.empty(rows)
    for v in range(rows):
        record = 0
        for t in range(length):
            if t == bounds[record]:
                y[v] = start[v, record]
                record += 1
            h = durations[t] / substeps
            for s in range(substeps):
                first = means[v, t, s] - 0.5 * rises[v, t, s]
                if not slow[v] > 0:
                    y[v] = first + rises[v, t, s]
                    continue
                pace, steep = 1.0 / slow[v], rises[v, t, s] / h
                towards = np.sign(first - y[v])
                # It is reached, and then followed, or outrun if that is too steep.
                nearing = pace - towards * steep
                reach = abs(first - y[v]) / nearing if nearing > 0 else np.inf
                if towards == 0:
                    reach = 0.0
                reach = min(reach, h)
                then = min(max(steep, -pace), pace)
                met, rest = y[v] + towards * pace * reach, h - reach
                whole = (y[v] + met) / 2 * reach + (met + then * rest / 2) * rest
                moment = y[v] * reach**2 / 2 + towards * pace * reach**3 / 3
                moment += reach * (met + then * rest / 2) * rest
                moment += met * rest**2 / 2 + then * rest**3 / 3
                means[v, t, s] = whole / h
                rises[v, t, s] = 12 * (moment - h * whole / 2) / (h * h)
                y[v] = met + then * rest
    return y


@compiled
def _dragged(
    durations: Array, widths: Array, start: Array, bounds: Integers, means: Array, rises: Array
) -> Array:
    rows, length, substeps = means.shape
    y = np.empty(rows)
    for v in range(rows):
        record, half = 0, 0.5 * widths[v]
        for t in range(length):
            if t == bounds[record]:
                y[v] = start[v, record]
                record += 1
            for s in range(substeps):
                first, rise = means[v, t, s] - 0.5 * rises[v, t, s], rises[v, t, s]
                if not half > 0:
                    y[v] = first + rise
                    continue
                y[v] = min(max(y[v], first - half), first + half)
                # It rests until the far side of the play arrives, and runs along from there.
                towards = np.sign(rise)
                rest = towards * (y[v] - first) + half
                rest = min(rest / abs(rise), 1.0) if rise != 0 else 1.0
                runs = 1.0 - rest
                gained = rise * runs
                means[v, t, s] = y[v] + 0.5 * gained * runs
                # The moment about the middle of a line over the last part of the sub-step.
                moment = gained * runs * (0.5 * (1.0 - runs / 3.0) - 0.25)
                rises[v, t, s] = 12 * moment
                y[v] += gained
    return y


@inlined
def _tilt(ratio: float) -> float:
    """Rise of the line with the mean and first moment of exp(-ratio s), s in [0, 1]."""
    if ratio < 0.02:
        return -ratio * (1 - ratio / 2 + 3 * ratio**2 / 20 - ratio**3 / 30)
    if np.isinf(ratio):
        return 0.0
    faded = np.exp(-ratio)
    return 12 * ((1 - faded - ratio * faded) / ratio**2 - (1 - faded) / (2 * ratio))
