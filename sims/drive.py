"""The way of a command to the actuator: static effects, delay and lag of a sampled signal.

An input is averaged over each sub-step, as the difference of its cumulative integral, so that
a jump or a delay that falls between two samples is exact in the mean and smooth in the delay.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

import numpy as np

from sims.effects.actuator import ActuatorEffect, ActuatorLag, Delay, StaticActuatorEffect
from sims.simulator import Array

Hold = Literal["zero", "linear"]


def column(value: float | Array) -> float | Array:
    """A value per row made to broadcast against (rows, samples)."""
    return value[:, None] if isinstance(value, np.ndarray) and value.ndim else value


def shaped(samples: Array, effects: Iterable[ActuatorEffect]) -> Array:
    """Samples (rows, T) of one input after gain, bias, dead zone and saturation."""
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


def lags(effects: Iterable[ActuatorEffect]) -> list[ActuatorLag]:
    """The lags among the effects."""
    return [effect for effect in effects if isinstance(effect, ActuatorLag)]


def substep_means(
    samples: Array, durations: Array, substeps: int, delay: float | Array, hold: Hold
) -> Array:
    """Mean of a delayed input over every sub-step.

    Args:
        samples: (rows, T) values of the input at the start of each sample interval.
        durations: (T,) lengths of the intervals in seconds.
        substeps: Equal sub-steps in each interval.
        delay: Seconds, scalar or (rows,).
        hold: ``"zero"``: each value is held over its interval; ``"linear"``: the input runs
            straight to the next value (and holds the last one). Before the first sample the
            input has its first value.

    Returns:
        (rows, T, substeps).
    """
    rows, length = samples.shape
    following = np.concatenate([samples[:, 1:], samples[:, -1:]], axis=1)
    slope = (following - samples) if hold == "linear" else np.zeros_like(samples)
    middles = (np.arange(substeps) + 0.5) / substeps
    prompt = samples[:, :, None] + slope[:, :, None] * middles
    late = np.broadcast_to(np.asarray(delay, float), (rows,))
    if not late.any():
        return prompt
    starts = np.concatenate([[0.0], np.cumsum(durations)])
    whole = np.cumsum((samples + 0.5 * slope) * durations, axis=1)
    whole = np.concatenate([np.zeros((rows, 1)), whole], axis=1)
    edges = starts[:-1, None] + durations[:, None] * np.arange(substeps) / substeps
    times = np.append(edges.ravel(), starts[-1]) - late[:, None]
    k = np.clip(np.searchsorted(starts, times, side="right") - 1, 0, length - 1)
    into = times - starts[k]
    value = np.take_along_axis(samples, k, axis=1)
    rise = np.take_along_axis(slope, k, axis=1) / durations[k]
    rise = np.where(into < 0, 0.0, rise)
    integral = np.take_along_axis(whole, k, axis=1) + into * (value + 0.5 * rise * into)
    means = np.diff(integral, axis=1).reshape(rows, length, substeps)
    means /= (durations / substeps)[:, None]
    return np.where(late[:, None, None] > 0, means, prompt)


def lagged(
    means: Array, durations: Array, time_constant: float | Array, start: Array
) -> tuple[Array, Array]:
    """First-order filter of an input that is held over each sub-step, exactly.

    Args:
        means: (rows, T, substeps).
        durations: (T,) seconds.
        time_constant: Seconds, scalar or (rows,); zero leaves the input as it is.
        start: (rows,) output before the first sub-step.

    Returns:
        Means of the output, same shape, and its last value, (rows,).
    """
    filtered = np.empty_like(means)
    y = np.array(start, float)
    for k, duration in enumerate(durations / means.shape[2]):
        with np.errstate(divide="ignore"):
            ratio = duration / np.asarray(time_constant, float)
        stays = np.exp(-ratio)
        share = -np.expm1(-ratio) / ratio
        for i in range(means.shape[2]):
            u = means[:, k, i]
            filtered[:, k, i] = u + (y - u) * share
            y = u + (y - u) * stays
    return filtered, y
