"""The way of a command to the actuator: static effects, delay and lag of a sampled signal.

An input is averaged over each sub-step, as the difference of its cumulative integral, so that
a jump or a delay that falls between two samples is exact in the mean and smooth in the delay.
Beside the mean goes the rise of a straight line that keeps the first moment as well: without
it, every jump inside a sub-step would leave a lasting error of the position.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from sims.compiled import compiled
from sims.effects.actuator import ActuatorEffect, ActuatorLag, Delay, StaticActuatorEffect
from sims.simulator import Array, Hold


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


def lags(effects: Iterable[ActuatorEffect]) -> list[ActuatorLag]:
    """The lags among the effects."""
    return [effect for effect in effects if isinstance(effect, ActuatorLag)]


def substep_inputs(
    samples: Array, durations: Array, substeps: int, delay: float | Array, hold: Hold
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
            straight to the next value (and holds the last one). Before the first sample the
            input has its first value.

    Returns:
        Means and rises, each (rows, T, substeps).
    """
    rows, length = samples.shape
    following = np.concatenate([samples[:, 1:], samples[:, -1:]], axis=1)
    slope = (following - samples) if hold == "linear" else np.zeros_like(samples)
    middles = (np.arange(substeps) + 0.5) / substeps
    prompt = samples[:, :, None] + slope[:, :, None] * middles
    prompt_rise = np.broadcast_to(slope[:, :, None] / substeps, prompt.shape)
    late = np.broadcast_to(np.asarray(delay, float), (rows,))
    if not late.any():
        return prompt, prompt_rise
    starts = np.concatenate([[0.0], np.cumsum(durations)])
    lengths = np.broadcast_to(durations, samples.shape)
    # Integrals of the input, and of its integral, up to every sample.
    once = _running(samples * lengths + 0.5 * slope * lengths)
    twice = _running(once[:, :-1] * lengths + 0.5 * samples * lengths**2 + slope * lengths**2 / 6)
    edges = starts[:-1, None] + durations[:, None] * np.arange(substeps) / substeps
    times = np.append(edges.ravel(), starts[-1]) - late[:, None]
    k = np.clip(np.searchsorted(starts, times, side="right") - 1, 0, length - 1)
    into = times - starts[k]
    value = np.take_along_axis(samples, k, axis=1)
    steep = np.where(into < 0, 0.0, np.take_along_axis(slope, k, axis=1) / durations[k])
    first = np.take_along_axis(once, k, axis=1)
    integral = first + into * (value + 0.5 * steep * into)
    area = np.take_along_axis(twice, k, axis=1) + into * (
        first + into * (0.5 * value + steep * into / 6)
    )
    h = np.repeat(durations / substeps, substeps)
    means = np.diff(integral, axis=1) / h
    # By parts: the moment about the middle is h (I0 + I1) / 2 - (A1 - A0).
    moment = 0.5 * h * (integral[:, :-1] + integral[:, 1:]) - np.diff(area, axis=1)
    rises = 12 * moment / (h * h)
    shape = (rows, length, substeps)
    there = late[:, None, None] > 0
    return (
        np.where(there, means.reshape(shape), prompt),
        np.where(there, rises.reshape(shape), prompt_rise),
    )


def _running(parts: Array) -> Array:
    """Sums of the first 0, 1, 2, ... parts along the second axis."""
    return np.concatenate([np.zeros((len(parts), 1)), np.cumsum(parts, axis=1)], axis=1)


def lagged(
    means: Array,
    rises: Array,
    durations: Array,
    time_constant: float | Array,
    start: Array,
) -> tuple[Array, Array, Array]:
    """First-order filter of an input that runs straight in each sub-step, exactly.

    Args:
        means, rises: (rows, T, substeps).
        durations: (T,) seconds.
        time_constant: Seconds, scalar or (rows,); zero leaves the input as it is.
        start: (rows,) output before the first sub-step.

    Returns:
        Means and rises of the output, same shapes, and its last value, (rows,).
    """
    substeps = means.shape[2]
    constants = np.broadcast_to(np.asarray(time_constant, float), len(means))
    with np.errstate(divide="ignore"):
        ratio = (durations / substeps) / constants[:, None]
    stays = np.exp(-ratio)
    # The output follows the line at a distance, and what it lacked at first fades.
    behind = rises / ratio[..., None]
    first, last = means - 0.5 * rises - behind, means + 0.5 * rises - behind
    gained = last - first * stays[..., None]
    # Only from interval to interval is it a recursion; inside, all rows at once.
    added = np.zeros_like(ratio)
    for i in range(substeps):
        added = added * stays + gained[:, :, i]
    begins, y = _carried(
        stays**substeps, added, np.array(np.broadcast_to(start, len(means)), float)
    )
    share, tilt = -np.expm1(-ratio) / ratio, _tilt(ratio)
    filtered, tilted = np.empty_like(means), np.empty_like(means)
    now = begins
    for i in range(substeps):
        lack = now - first[:, :, i]
        filtered[:, :, i] = means[:, :, i] - behind[:, :, i] + lack * share
        tilted[:, :, i] = rises[:, :, i] + lack * tilt
        now = stays * now + gained[:, :, i]
    return filtered, tilted, y


@compiled
def _carried(kept: Array, added: Array, start: Array) -> tuple[Array, Array]:
    """Values before each interval of ``y = kept y + added``, and those after the last."""
    before, y = np.empty_like(kept), start.copy()
    for i in range(len(kept)):
        for k in range(kept.shape[1]):
            before[i, k] = y[i]
            y[i] = kept[i, k] * y[i] + added[i, k]
    return before, y


def _tilt(ratio: Array) -> Array:
    """Rise of the line with the mean and first moment of exp(-ratio s), s in [0, 1]."""
    large = np.minimum(np.maximum(ratio, 0.02), 700.0)
    faded = np.exp(-large)
    exact = 12 * ((1 - faded - large * faded) / large**2 - (1 - faded) / (2 * large))
    small = np.minimum(ratio, 0.02)
    series = -small * (1 - small / 2 + 3 * small**2 / 20 - small**3 / 30)
    return np.where(ratio < 0.02, series, np.where(np.isinf(ratio), 0.0, exact))
