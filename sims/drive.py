"""The way of a command to the actuator: static effects and delay of a sampled signal.

An input is averaged over each sub-step, as the difference of its cumulative integral, so that
a jump or a delay that falls between two samples is exact in the mean and smooth in the delay.
Beside the mean goes the rise of a straight line that keeps the first moment as well: without
it, every jump inside a sub-step would leave a lasting error of the position.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from sims.compiled import compiled
from sims.effects.actuator import ActuatorEffect, Delay, StaticActuatorEffect
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
