"""Values and derivatives of a model at every sample: the linear system behind a Gauss-Newton step.

Every sample has its own state, a node; one sample interval is simulated from every node, all in
one batch, for every perturbed state and unknown at once.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.carrying import weighted
from residual.gap.data.samples import Samples
from residual.gap.data.windows import Windows
from residual.gap.model.model import Model

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class Slope:
    """Values at every node and their derivatives by it, for one vector of unknowns.

    Attributes:
        after: Where each node arrives after its interval, (n, n_s).
        by_state: Derivative of ``after`` by the node, (n, n_s, n_s).
        shown: What the sensors show at the node, (n, n_s).
        shown_by_state: Diagonal of its derivative by the node, (n, n_s).
    """

    after: Array
    by_state: Array
    shown: Array
    shown_by_state: Array


def slopes(
    model: Model,
    samples: Samples,
    nodes: Array,
    theta: Array,
    scale: Array,
    by_state: Array | None = None,
    rows: NDArray[np.int64] | None = None,
) -> Slope:
    """Everything at the nodes in one batch.

    Args:
        scale: Typical variation of every state; a state is moved by 1e-4 of it.
        by_state: Derivative by the state from an earlier call, to be used again.
        rows: Samples that matter, if not all; what is said of the others is zero.
    """
    own = nodes if rows is None else nodes[rows]
    width = own.shape[1]
    moves = np.zeros((0, width)) if by_state is not None else 1e-4 * np.diag(scale)
    states = np.repeat(own[None], 1 + len(moves), axis=0)
    states[1:] += moves[:, None, :]
    after = model.advance(samples, states, np.tile(theta, (len(states), 1)), rows)
    if by_state is None:
        with np.errstate(over="ignore", invalid="ignore"):  # a trial that runs away loses later on
            columns = [(after[1 + i] - after[0]) / moves[i, i] for i in range(width)]
        slope = np.stack(columns, axis=-1)
    else:
        slope = by_state if rows is None else by_state[rows]
    shown, shown_by_state = own, np.ones_like(own)
    if model.has_sensor:
        moved = np.stack([own, own + 1e-4 * scale])
        shown, there = model.sense(moved, np.tile(theta, (2, 1)))
        shown_by_state = (there - shown) / (1e-4 * scale)
    found = (after[0], slope, shown, shown_by_state)
    return Slope(*(_everywhere(values, rows, len(nodes)) for values in found))


def by_unknowns(
    model: Model,
    samples: Samples,
    slope: Slope,
    nodes: Array,
    theta: Array,
    widths: Array,
    rows: NDArray[np.int64] | None = None,
) -> tuple[Array, Array]:
    """Derivatives by the unknowns, of where each node arrives and of what the sensors show there.

    Args:
        slope: Values at the nodes.
        widths: Finite-difference width of every unknown.
        rows: Samples that matter, if not all; the derivatives of the others are zero.

    Returns:
        Two of shape (n, n_s, p).
    """
    p, own = len(theta), nodes if rows is None else nodes[rows]
    if p == 0:
        return np.zeros((*nodes.shape, 0)), np.zeros((*nodes.shape, 0))
    up = np.where(theta + widths > model.high, -widths, widths)
    states, thetas = np.repeat(own[None], p, axis=0), theta + np.diag(up)
    values = [(model.advance(samples, states, thetas, rows), slope.after)]
    values += [(model.sense(states, thetas), slope.shown)] if model.has_sensor else []
    found = []
    for moved, base in values:
        with np.errstate(over="ignore", invalid="ignore"):
            columns = (moved - (base if rows is None else base[rows])) / up[:, None, None]
        found.append(_everywhere(columns.transpose(1, 2, 0), rows, len(nodes)))
    return found[0], found[1] if model.has_sensor else np.zeros_like(found[0])


def _everywhere(values: Array, rows: NDArray[np.int64] | None, count: int) -> Array:
    """Values of some samples among zeros for all, (n, ...)."""
    if rows is None or len(rows) == count:
        return values
    full = np.zeros((count, *values.shape[1:]))
    full[rows] = values
    return full


def observe(
    samples: Samples, windows: Windows, slope: Slope, response: Array, sigma: Array
) -> Array:
    """Whitened output of a linear response (W, L, n_s, c) -> (W, L, m, c)."""
    measured = samples.measured
    valid = np.isfinite(samples.seen[:, measured])[windows.index] & windows.inside[..., None]
    gain = slope.shown_by_state[:, measured][windows.index] / sigma
    return weighted(response, measured, gain * valid)


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
