"""The way of a command to the actuator: static effects, delay and lag of a sampled signal.

An input is averaged over each sub-step, as the difference of its cumulative integral, so that
a jump or a delay that falls between two samples is exact in the mean and smooth in the delay.
Beside the mean goes the rise of a straight line that keeps the first moment as well: without
it, every jump inside a sub-step would leave a lasting error of the position.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from sims.compiled import compiled, inlined
from sims.effects.actuator import ActuatorEffect, ActuatorLag, Delay, StaticActuatorEffect
from sims.effects.slew import SlewLimit
from sims.simulator import Array, Hold

Integers = NDArray[np.int64]


def column(value: float | Array) -> float | Array:
    """A value per row made to broadcast against (rows, samples)."""
    return value[:, None] if isinstance(value, np.ndarray) and value.ndim else value


def shaped(samples: Array, effects: Iterable[ActuatorEffect]) -> Array:
    """Samples (rows, T) of one input after all effects without memory."""
    for effect in sorted(effects, key=lambda effect: effect.stage):
        if isinstance(effect, StaticActuatorEffect):
            columns = effect.with_values(
                **{name: column(getattr(effect, name)) for name in effect.numbers()}
            )
            # Rows at zero strength keep their bits.
            samples = np.where(column(effect.present()), columns.shape(samples), samples)
    return samples


def total_delay(effects: Iterable[ActuatorEffect]) -> float | Array:
    """Sum of the delays in seconds, a scalar or (rows,)."""
    return sum((effect.time for effect in effects if isinstance(effect, Delay)), 0.0)


def followers(effects: Iterable[ActuatorEffect]) -> list[ActuatorLag | SlewLimit]:
    """The effects whose output follows the command, lags before limits of pace."""
    found = [effect for effect in effects if isinstance(effect, ActuatorLag | SlewLimit)]
    return sorted(found, key=lambda effect: effect.stage)


def substep_inputs(
    samples: Array,
    durations: Array,
    substeps: int,
    delay: float | Array,
    hold: Hold,
    bounds: Sequence[int],
) -> tuple[Array, Array]:
    """Mean and rise of a delayed input in every sub-step.

    The rise is the difference between both ends of the straight line that has the same mean
    and the same first moment as the input; with it, positions are right too.

    Args:
        samples: (rows, T) values of the input at the start of each sample interval.
        durations: (T,) lengths of the intervals in seconds.
        substeps: Equal sub-steps in each interval.
        delay: Seconds, scalar or (rows,).
        hold: ``"zero"``: each value is held over its interval; ``"linear"``: the input runs
            straight to the next value (and holds the last one).
        bounds: Where each record begins, and T. Before its first sample the input has its first
            value.

    Returns:
        Means and rises, each (rows, T, substeps).
    """
    slope = np.zeros_like(samples)
    if hold == "linear":
        slope[:, :-1] = np.diff(samples, axis=1)
        slope[:, np.asarray(bounds[1:]) - 1] = 0.0
    middles = (np.arange(substeps) + 0.5) / substeps
    means = samples[:, :, None] + slope[:, :, None] * middles
    rises = np.repeat(slope[:, :, None] / substeps, substeps, axis=2)
    late = np.array(np.broadcast_to(np.asarray(delay, float), len(samples)))
    if late.any():
        values, ends = np.ascontiguousarray(samples), np.asarray(bounds, np.int64)
        _delayed(values, slope, durations, ends, late, means, rises)
    return means, rises


@compiled
def _delayed(
    samples: Array, slope: Array, durations: Array, bounds: Integers, late: Array, means: Array,
    rises: Array,
) -> None:  # fmt: skip
    """Writes means and rises of the rows that are late; see ``substep_inputs``."""
    substeps = means.shape[2]
    for v in range(len(means)):
        if not late[v] > 0:
            continue
        for record in range(len(bounds) - 1):
            stop = bounds[record + 1]
            # Beside the sample that is received: when it began, and up to then the integral of
            # the input and that of this integral.
            k, begun, once, twice = bounds[record], 0.0, 0.0, 0.0
            before, below, edge = 0.0, 0.0, 0.0
            for t in range(bounds[record], stop):
                h = durations[t] / substeps
                for s in range(substeps + 1):
                    time = edge + durations[t] * s / substeps - late[v]
                    while k < stop - 1 and begun + durations[k] <= time:
                        d = durations[k]
                        twice += once * d + 0.5 * samples[v, k] * d**2 + slope[v, k] * d**2 / 6
                        once += (samples[v, k] + 0.5 * slope[v, k]) * d
                        begun += d
                        k += 1
                    into, value = time - begun, samples[v, k]
                    steep = 0.0 if into < 0 else slope[v, k] / durations[k]
                    integral = once + into * (value + 0.5 * steep * into)
                    area = twice + into * (once + into * (0.5 * value + steep * into / 6))
                    if s > 0:
                        means[v, t, s - 1] = (integral - before) / h
                        # By parts: the moment about the middle is h (I0 + I1) / 2 - (A1 - A0).
                        moment = 0.5 * h * (before + integral) - (area - below)
                        rises[v, t, s - 1] = 12 * moment / (h * h)
                    before, below = integral, area
                edge += durations[t]


def lagged(
    means: Array,
    rises: Array,
    durations: Array,
    time_constant: float | Array,
    start: Array,
    bounds: Sequence[int],
) -> tuple[Array, Array, Array]:
    """First-order filter of an input that runs straight in each sub-step, exactly.

    Args:
        means, rises: (rows, T, substeps).
        durations: (T,) seconds.
        time_constant: Seconds, scalar or (rows,); zero leaves the input as it is.
        start: Output before the first sub-step of each record, (rows, records).
        bounds: Where each record begins, and T.

    Returns:
        Means and rises of the output, same shapes, and its last value, (rows,).
    """
    constants = np.broadcast_to(np.asarray(time_constant, float), len(means))
    filtered, tilted = np.empty(means.shape), np.empty(means.shape)
    last = _filtered(
        np.ascontiguousarray(means, float), np.ascontiguousarray(rises, float),
        np.ascontiguousarray(durations, float), np.ascontiguousarray(constants),
        np.ascontiguousarray(start, float), np.asarray(bounds, np.int64), filtered, tilted,
    )  # fmt: skip
    return filtered, tilted, last


@compiled
def _filtered(
    means: Array, rises: Array, durations: Array, constants: Array, start: Array,
    bounds: Integers, filtered: Array, tilted: Array,
) -> Array:  # fmt: skip
    """Writes means and rises of the output of ``lagged``, and returns where it ends."""
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
                filtered[v, t, s] = means[v, t, s] - behind + lack * share
                tilted[v, t, s] = rises[v, t, s] + lack * tilt
                y[v] = stays * y[v] + last - first * stays
    return y


def limited(
    means: Array,
    rises: Array,
    durations: Array,
    seconds_per_unit: float | Array,
    start: Array,
    bounds: Sequence[int],
) -> tuple[Array, Array, Array]:
    """An input that runs straight in each sub-step, followed at a limited pace, exactly.

    Args:
        means, rises: (rows, T, substeps).
        durations: (T,) seconds.
        seconds_per_unit: What a change by one unit takes, scalar or (rows,); zero leaves the
            input as it is.
        start: Output before the first sub-step of each record, (rows, records).
        bounds: Where each record begins, and T.

    Returns:
        As ``lagged``.
    """
    slow = np.broadcast_to(np.asarray(seconds_per_unit, float), len(means))
    followed, tilted = np.array(means, float), np.array(rises, float)
    last = _limited(
        np.ascontiguousarray(durations, float), np.ascontiguousarray(slow),
        np.ascontiguousarray(start, float), np.asarray(bounds, np.int64), followed, tilted,
    )  # fmt: skip
    return followed, tilted, last


@compiled
def _limited(
    durations: Array, slow: Array, start: Array, bounds: Integers, means: Array, rises: Array
) -> Array:
    """Replaces means and rises by those of the output of ``limited``; returns where it ends."""
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


@inlined
def _tilt(ratio: float) -> float:
    """Rise of the line with the mean and first moment of exp(-ratio s), s in [0, 1]."""
    if ratio < 0.02:
        return -ratio * (1 - ratio / 2 + 3 * ratio**2 / 20 - ratio**3 / 30)
    if np.isinf(ratio):
        return 0.0
    faded = np.exp(-ratio)
    return 12 * ((1 - faded - ratio * faded) / ratio**2 - (1 - faded) / (2 * ratio))
