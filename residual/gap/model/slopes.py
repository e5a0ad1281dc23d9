"""Values and derivatives of a model at every sample: the linear system behind a Gauss-Newton step.

Every sample has its own state, a node; one sample interval is simulated from every node, all in
one batch, for every perturbed state and unknown at once.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.samples import Samples
from residual.gap.data.windows import Windows
from residual.gap.model.model import Model

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class Slope:
    """Values and derivatives at every node, for one vector of unknowns.

    Attributes:
        after: Where each node arrives after its interval, (n, n_s).
        by_state: Derivative of ``after`` by the node, (n, n_s, n_s).
        by_knob: Derivative of ``after`` by the unknowns, (n, n_s, p).
        shown: What the sensors show at the node, (n, n_s).
        shown_by_state: Diagonal of its derivative by the node, (n, n_s).
        shown_by_knob: Its derivative by the unknowns, (n, n_s, p).
    """

    after: Array
    by_state: Array
    by_knob: Array
    shown: Array
    shown_by_state: Array
    shown_by_knob: Array


def slopes(
    model: Model,
    samples: Samples,
    nodes: Array,
    theta: Array,
    widths: Array,
    scale: Array,
    by_state: Array | None = None,
    rows: NDArray[np.int64] | None = None,
) -> Slope:
    """Everything at the nodes in one batch.

    Args:
        widths: Finite-difference width of every unknown.
        scale: Typical variation of every state; a state is moved by 1e-4 of it.
        by_state: Derivative by the state from an earlier call, to be used again.
        rows: Samples that matter, if not all; the derivatives of the others are zero.
    """
    if rows is not None and len(rows) < len(nodes):
        return _some(model, samples, nodes, theta, widths, scale, by_state, rows)
    return _all(model, samples, nodes, theta, widths, scale, by_state, None)


def _some(
    model: Model, samples: Samples, nodes: Array, theta: Array, widths: Array, scale: Array,
    by_state: Array | None, rows: NDArray[np.int64],
) -> Slope:  # fmt: skip
    known = None if by_state is None else by_state[rows]
    part = _all(model, samples, nodes[rows], theta, widths, scale, known, rows)
    full = {}
    for field in dataclasses.fields(Slope):
        values = getattr(part, field.name)
        full[field.name] = np.zeros((len(nodes), *values.shape[1:]))
        full[field.name][rows] = values
    return Slope(**full)


def _all(
    model: Model, samples: Samples, nodes: Array, theta: Array, widths: Array, scale: Array,
    by_state: Array | None, rows: NDArray[np.int64] | None,
) -> Slope:  # fmt: skip
    n, width = nodes.shape
    p = len(theta)
    moves = np.zeros((0, width)) if by_state is not None else 1e-4 * np.diag(scale)
    up = np.where(theta + widths > model.high, -widths, widths)
    thetas = np.vstack([theta[None], np.repeat(theta[None], len(moves), 0), theta + np.diag(up)])
    states = np.repeat(nodes[None], 1 + len(moves) + p, axis=0)
    states[1 : 1 + len(moves)] += moves[:, None, :]
    after = model.advance(samples, states, thetas, rows)
    base = after[0]
    by_knob = np.zeros((n, width, p))
    # A trial that runs away loses later on.
    with np.errstate(over="ignore", invalid="ignore"):
        if by_state is None:
            by_state = np.stack(
                [(after[1 + i] - base) / moves[i, i] for i in range(width)], axis=-1
            )
        for j in range(p):
            by_knob[:, :, j] = (after[1 + len(moves) + j] - base) / up[j]
    shown_by_state, shown_by_knob = np.ones((n, width)), np.zeros((n, width, p))
    shown = nodes
    if model.has_sensor:
        moved = np.repeat(nodes[None], 2 + p, axis=0)
        moved[1] += 1e-4 * scale
        seen = model.sense(moved, np.vstack([theta[None], theta[None], theta + np.diag(up)]))
        shown = seen[0]
        shown_by_state = (seen[1] - shown) / (1e-4 * scale)
        for j in range(p):
            shown_by_knob[:, :, j] = (seen[2 + j] - shown) / up[j]
    return Slope(base, by_state, by_knob, shown, shown_by_state, shown_by_knob)


def observe(
    samples: Samples, windows: Windows, slope: Slope, response: Array, sigma: Array
) -> Array:
    """Whitened output of a linear response (W, L, n_s, c) -> (W, L, m, c)."""
    measured = samples.measured
    valid = np.isfinite(samples.seen[:, measured])[windows.index] & windows.inside[..., None]
    gain = slope.shown_by_state[:, measured][windows.index] / sigma
    return response[:, :, measured] * (gain * valid)[..., None]


def misfit(samples: Samples, windows: Windows, slope: Slope, sigma: Array) -> Array:
    """Whitened difference of measurement and node, zero where nothing was measured, (W, L, m)."""
    measured = samples.measured
    gap = (samples.seen[:, measured] - slope.shown[:, measured])[windows.index] / sigma
    return np.where(np.isfinite(gap) & windows.inside[..., None], gap, 0.0)


def defects(samples: Samples, slope: Slope, nodes: Array) -> Array:
    """How far each node's successor is from where the node arrives, (n, n_s)."""
    gap = np.zeros_like(nodes)
    gap[:-1] = slope.after[:-1] - nodes[1:]
    return gap
