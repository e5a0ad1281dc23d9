"""Sensor noise and the path of the states, without trusting the model's forces."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.carrying import carry
from residual.gap.data.samples import Samples
from residual.gap.data.windows import Windows, fixed
from residual.gap.model.model import Model
from residual.gap.model.slopes import Slope, defects, misfit, observe, slopes
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: Readings in the short windows that tell noise from motion.
READINGS = 8
#: Windows that are fitted in one batch: a long record takes little memory beside its own rows.
AT_ONCE = 4096


@dataclasses.dataclass(frozen=True)
class Noise:
    """Sensor noise.

    Attributes:
        sigma: Noise of every measured channel, (m,).
        error: Standard error of each sigma, (m,).
    """

    sigma: Array
    error: Array


@dataclasses.dataclass(frozen=True)
class Floor(Noise):
    """What a smooth missing force cannot explain.

    Attributes:
        nodes: Smoothed state at every sample, (n, n_s).
        slope: Derivatives at the nodes.
        force: Missing acceleration (rate of change for first-order states) at every sample,
            (n, number of driven states).
    """

    nodes: Array
    slope: Slope
    force: Array


def driven_states(model: Model) -> list[int]:
    """Columns a missing effect would push: rates, and states that have none (first order)."""
    channels = model.simulator.physical_channels
    pushed = {c.rate_of for c in channels}
    return [i for i, c in enumerate(channels) if c.kind != "position" or c.name not in pushed]


def seen_driven(model: Model, samples: Samples) -> list[int]:
    """Places in ``driven_states`` of what was measured itself, or by the position of its rate.

    What nobody measured moves what was measured through the model alone. A free force on it as
    well would fit a short window exactly, and leave no residual to read the noise from.
    """
    channels = model.simulator.physical_channels
    seen = {channels[i].name for i in samples.measured}
    columns = driven_states(model)
    return [j for j, c in enumerate(columns) if {channels[c].name, channels[c].rate_of} & seen]


def push(model: Model, samples: Samples) -> Array:
    """Change of the next state by a unit acceleration held over the interval, (n, n_s, driven)."""
    channels = model.simulator.physical_channels
    names = [c.name for c in channels]
    columns = driven_states(model)
    effect = np.zeros((len(samples), model.width, len(columns)))
    for j, column in enumerate(columns):
        effect[:, column, j] = samples.durations
        if channels[column].kind == "rate" and channels[column].rate_of in names:
            effect[:, names.index(str(channels[column].rate_of)), j] = 0.5 * samples.durations**2
    return effect


def estimate(
    model: Model,
    samples: Samples,
    nodes: Array,
    theta: Array,
    sigma: Array,
    scale: Array,
    terms: int | None = None,
    iterations: int = 4,
) -> Floor:
    """Fit short windows by the model plus a smooth free force; what is left is noise.

    The force is a cosine series over the window, for each driven state that was measured, so that a
    missing effect does not count as noise however large it is.

    Args:
        sigma: First guess of the noise, (m,).
        terms: Cosines in the series; by default 4 if some rate is measured and 3 if not.
    """
    measured = samples.measured
    driven = driven_states(model)
    pushed = seen_driven(model, samples)
    free = model.free
    if terms is None:
        terms = 4 if set(measured) & set(driven) else 3
    # Rows may be without a reading: as many of the channel that was read most are to be in each.
    read = float(np.isfinite(samples.seen[:, measured]).mean(axis=0).max())
    length = round(READINGS / read)
    windows = fixed(samples, length, shortest=length - 1)
    start = np.zeros((nodes.shape[1], len(free)))
    start[free, range(len(free))] = 1.0
    count, places = windows.index.shape
    phase = np.pi * (np.arange(places) + 0.5) / (places - 1)
    series = np.cos(np.outer(phase, np.arange(terms)))
    unit = push(model, samples)[..., pushed]
    weight = np.zeros((count, len(pushed) * terms))
    error = sigma
    for turn in range(iterations):
        slope = slopes(model, samples, nodes, theta, scale)
        gaps = defects(samples, slope, nodes)
        nodes = nodes.copy()
        found = []
        for begin in range(0, count, AT_ONCE):
            part = slice(begin, begin + AT_ONCE)
            some = windows[part]
            forces = np.einsum("wlsd,lt->wlsdt", unit[some.index], series)
            forces = forces.reshape(*forces.shape[:3], -1)
            shift, change, *seen = _refitted(
                samples, some, slope, gaps[some.index], forces, weight[part], start, sigma,
                scale[free],
            )  # fmt: skip
            weight[part] += change
            nodes[some.index[some.inside]] += shift[some.inside]
            found.append(seen)
        if turn >= 1:
            left, leverage = (np.concatenate(parts) for parts in zip(*found, strict=True))
            sigma, error = _spread(samples, windows, left, leverage, sigma)
    slope = slopes(model, samples, nodes, theta, scale)
    force = np.zeros((len(samples), len(driven)))
    local = np.einsum("wdt,lt->wld", weight.reshape(count, len(pushed), terms), series)
    rows = windows.index[windows.inside]
    force[rows[:, None], pushed] = local[windows.inside]
    return Floor(sigma, error, nodes, slope, force)


def _refitted(
    samples: Samples, windows: Windows, slope: Slope, gaps: Array, forces: Array, weight: Array,
    start: Array, sigma: Array, scale: Array,
) -> tuple[Array, Array, Array, Array]:  # fmt: skip
    """A Gauss-Newton turn of some windows.

    Returns:
        What to add to the nodes (W, L, n_s) and to the weights of the forces (W, q), and of every
        whitened measurement what is left and how far the fit follows it, (W, L m) each.
    """
    count, f = len(windows), start.shape[1]
    columns = f + forces.shape[-1]
    added = (forces @ weight[:, None, :, None])[..., 0]
    injected = np.concatenate([forces, (gaps + added)[..., None]], axis=3)
    response = carry(windows, slope.by_state, start, injected)
    shown = observe(samples, windows, slope, response, sigma)
    residual = (misfit(samples, windows, slope, sigma) - shown[..., -1]).reshape(count, -1)
    seen = shown[..., :-1].reshape(count, -1, columns)
    pad = np.zeros((count, f, columns))
    pad[:, range(f), range(f)] = 1e-2 / scale
    basis, triangle = np.linalg.qr(np.concatenate([seen, pad], axis=1))
    # A force that moves nothing measured has no direction of its own, and takes no freedom.
    basis *= (np.abs(np.einsum("wii->wi", triangle)) > 1e-9)[:, None, :]
    basis = basis[:, : residual.shape[1]]
    triangle = triangle + 1e-12 * np.eye(columns)
    move = np.linalg.solve(triangle, basis.transpose(0, 2, 1) @ residual[..., None])
    left = residual - (seen @ move)[..., 0]
    move = move[..., 0]
    move[:, :f] = np.clip(move[:, :f], -3 * scale, 3 * scale)
    shift = (response[..., :-1] @ move[:, None, :, None])[..., 0] + response[..., -1]
    return shift, move[:, f:], left, (basis**2).sum(axis=2)


def _spread(
    samples: Samples, windows: Windows, left: Array, leverage: Array, sigma: Array
) -> tuple[Array, Array]:
    """Noise of every channel from residual and leverage, windows that did not settle left out."""
    measured = samples.measured
    count, places = windows.index.shape
    valid = np.isfinite(samples.seen[:, measured])[windows.index] & windows.inside[..., None]
    leverage = leverage.reshape(count, places, -1)
    square = (left**2).reshape(count, places, -1)
    total = square.sum(axis=(1, 2))
    settled = total < 12 * np.median(total) + 1e-300
    freedom = np.where(valid, 1 - leverage, 0.0)[settled].sum(axis=(0, 1))
    variance = np.where(valid, square, 0.0)[settled].sum(axis=(0, 1)) / np.maximum(freedom, 1e-9)
    fresh = sigma * np.sqrt(np.maximum(variance, 1e-12))
    return fresh, fresh / np.sqrt(2 * np.maximum(freedom, 1.0))


def with_walks(simulator: HostSimulator, samples: Samples, sigma: Array, seconds: float) -> Array:
    """Noise of every measured channel, with what summing another one up adds within a window.

    The error of a sum over noisy samples is a random walk: over t seconds its standard deviation is
    sigma sqrt(dt t), with the noise sigma and the sampling time dt of what was summed up.

    Args:
        simulator: Its channels say of what they are the integral.
        samples: The table.
        sigma: Noise from sample to sample, (m,).
        seconds: Length of a window.
    """
    channels = simulator.physical_channels
    names = [channels[c].name for c in samples.measured]
    found = np.array(sigma)
    step = samples.step / samples.stride
    for place, column in enumerate(samples.measured):
        source = channels[column].integrates
        if source in names:
            walk = sigma[names.index(source)] * np.sqrt(step * seconds)
            found[place] = np.hypot(sigma[place], walk)
    return found


def local_noise(samples: Samples, length: int = 9) -> Array:
    """First guess of every measured channel's noise: what a local cubic leaves, (m,)."""
    guesses = []
    for column in samples.measured:
        squares: list[float] = []
        for start, stop in samples.runs:
            read = start + np.flatnonzero(np.isfinite(samples.seen[start:stop, column]))
            for a in range(0, len(read) - length + 1, length):
                t = samples.times[read[a : a + length]]
                y = samples.seen[read[a : a + length], column]
                basis = np.vander((t - t.mean()) / max(np.ptp(t), 1e-12), 4)
                rest = y - basis @ np.linalg.lstsq(basis, y, rcond=None)[0]
                squares.append(float(rest @ rest) / (length - 4))
        spread = np.nanstd(samples.seen[:, column])
        guess = np.sqrt(np.median(squares)) if squares else 1e-3 * spread
        guesses.append(
            max(guess, quantum(samples.seen[:, column]) / np.sqrt(12), 1e-9 * spread, 1e-12)
        )
    return np.array(guesses)


def quantum(column: Array) -> float:
    """Quantisation step of a channel, 0 if its values do not repeat."""
    values = np.unique(column[np.isfinite(column)])
    if len(values) < 2:
        return 0.0
    gaps = np.diff(values)
    gaps = gaps[gaps > 1e-9 * np.abs(values).max()]
    if len(gaps) == 0:
        return 0.0
    step = float(np.quantile(gaps, 0.05))
    off = np.abs(gaps / step - np.round(gaps / step))
    return step if (off < 0.05).mean() > 0.95 else 0.0
