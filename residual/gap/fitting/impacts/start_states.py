"""Start states of windows: least squares for each by itself, with its own step length.

Impacts make a window's residual kinked in its start state, and each window in its own way.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from residual.gap.fitting.impacts.single_shooting import (
    StartFit,
    WindowData,
    residual,
    simulate,
    whitened,
)
from residual.gap.model.model import Model

Array = NDArray[np.float64]

#: Steps of start states between two full derivatives.
TRIES = 10


def by_start(model: Model, theta: Array, data: WindowData, starts: Array, base: Array) -> Array:
    """Derivative of the whitened output by the start states, (W, R, n_p)."""
    channels = model.simulator.physical_channels
    moved = [i for i, c in enumerate(channels) if not (c.invariant or data.known[i])]
    steps = data.moves
    variants = starts[None] + np.zeros((len(moved), 1, 1))
    for row, i in enumerate(moved):
        variants[row, :, i] += steps[i]
    outputs = simulate(model, theta, data, variants) if moved else variants
    found = np.zeros((len(data), base[0].size + len(steps), len(steps)))
    for row, i in enumerate(moved):
        found[:, :, i] = whitened(data, (outputs[row] - base) / steps[i])
    measured = data.samples.measured
    for i, channel in enumerate(channels):
        if channel.invariant and not data.known[i]:
            # The motion is the same from there, only that much further.
            found[:, :, i] = whitened(data, np.where(measured == i, 1.0, 0.0) + 0.0 * base)
        found[:, base[0].size + i, i] = 1.0 / data.doubt[i]
    return found


def begun(
    model: Model, theta: Array, data: WindowData, starts: Array, slope: Array | None = None
) -> StartFit:
    """Windows as they are from start states, with a derivative from nearby if there is one."""
    base = simulate(model, theta, data, starts[None])[0]
    if slope is None:
        slope = by_start(model, theta, data, starts, base)
    return StartFit(starts, base, residual(data, starts, base), slope)


def fit_starts(
    model: Model, theta: Array, data: WindowData, starts: Array, turns: int,
    slope: Array | None = None,
) -> StartFit:  # fmt: skip
    """Least squares for the start state of every window (Levenberg and Marquardt).

    Between two full derivatives, steps of Broyden's method go on with a corrected one: they cost
    a simulation each instead of one for every state.

    Args:
        turns: Rounds of steps, with a full derivative after each.
        slope: Derivative by the start states from nearby, to start with.
    """
    found = begun(model, theta, data, starts, slope)
    for _ in range(turns):
        found = renewed(model, theta, data, descend(model, theta, data, found))
    return found


def renewed(model: Model, theta: Array, data: WindowData, found: StartFit) -> StartFit:
    """A fit with the derivative where it has arrived."""
    slope = by_start(model, theta, data, found.starts, found.shown)
    return dataclasses.replace(found, by_start=slope)


def begun_beside(
    model: Model, theta: Array, data: WindowData, fitted: StartFit, change: Array
) -> StartFit:
    """Windows fitted with other numbers, begun from start states that make up for what these do to
    the whitened output in the linear picture, (W, R), where that is better."""
    inverse = np.linalg.pinv(fitted.by_start, rcond=1e-8)
    moved = fitted.starts + (inverse @ (fitted.residual - change)[..., None])[..., 0]
    outputs = simulate(model, theta, data, np.stack([fitted.starts, moved]))
    stay, move = (
        StartFit(starts, output, residual(data, starts, output), fitted.by_start)
        for starts, output in zip((fitted.starts, moved), outputs, strict=True)
    )
    # An impact may spoil the linear start of one window without spoiling the others.
    moves = np.flatnonzero(move.costs <= stay.costs)
    return stay.with_windows(moves, move.take(moves))


def descend(
    model: Model, theta: Array, data: WindowData, found: StartFit, tries: int = TRIES
) -> StartFit:
    """Some steps of every window by the derivative it has, corrected as they go."""
    if data.known.all():
        return found
    starts, base, now = found.starts.copy(), found.shown.copy(), found.residual.copy()
    local, damping = found.by_start, np.full(len(data), 1e-3)
    busy = np.ones(len(data), bool)
    for _ in range(tries):
        rows = np.flatnonzero(busy)
        if not len(rows):
            break
        part = data.take(rows)
        step = _step(local[rows], now[rows], damping[rows])
        there = starts[rows] + step
        output = simulate(model, theta, part, there[None])[0]
        trial = residual(part, there, output)
        old, new = (now[rows] ** 2).sum(1), (trial**2).sum(1)
        # Broyden's correction of the derivative along the step that was made.
        surprise = now[rows] - trial - (local[rows] @ step[..., None])[..., 0]
        size = np.maximum((step**2 / data.moves**2).sum(1), 1e-12)
        local = local.copy()
        local[rows] += surprise[:, :, None] * (step / data.moves**2 / size[:, None])[:, None]
        good = new < old
        damping[rows] = np.where(good, 0.3 * damping[rows], 10 * damping[rows])
        won = rows[good]
        starts[won], now[won], base[won] = there[good], trial[good], output[good]
        busy[rows] = ~good | (old - new > 0.02 * old + 0.1)
    return StartFit(starts, base, now, found.by_start)


def _step(slope: Array, now: Array, damping: Array) -> Array:
    """Damped Gauss-Newton steps, (W, n_p)."""
    normal = slope.transpose(0, 2, 1) @ slope
    size = np.sqrt(np.maximum(np.einsum("wii->wi", normal), 1e-12))
    scaled = normal / (size[:, :, None] * size[:, None, :])
    scaled = scaled + (damping[:, None, None] + 1e-9) * np.eye(slope.shape[2])
    right = (slope.transpose(0, 2, 1) @ now[..., None])[..., 0] / size
    return np.linalg.solve(scaled, right[..., None])[..., 0] / size
