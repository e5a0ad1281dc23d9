"""Fit of effects and of the free start state of every window (multiple shooting, lifted).

Every sample has its own state, a node; windows only demand that nodes follow each other. A step
of Gauss-Newton then needs one sample interval from every node, all in one batch, and no window
can run away: the nodes start at the measured path. The continuity defects are condensed out, so
the unknowns are the effects' numbers and one start state for each window, and the start states
are projected out (variable projection). At convergence the result is that of single shooting
over each window. Source: Albersmeyer and Diehl, "The lifted Newton method and its application in
optimization", SIAM J. Optim. 20 (2010).
"""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from residual.gap.model import Model
from residual.gap.samples import Samples
from residual.gap.windows import Windows, carry

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


@dataclasses.dataclass(frozen=True)
class Fit:
    """Result of fitting a model to windows.

    Attributes:
        theta: Unknowns, (p,).
        nodes: State at every sample of the table, (n, n_s).
        costs: Whitened squared residual of every window, (W,).
        merit: Sum of the costs, those above ``cap`` counted as cap (1 + log(cost / cap)).
        cap: See ``merit``.
        residual: Whitened residual, (W, L, m), zero where nothing was measured.
        by_start: Its derivative by the window's start state, (W, L m, f).
        by_knob: Its derivative by the unknowns, start states projected out, (W, L m, p).
        projected: The residual with start states projected out, (W, L m).
        slope: Derivatives at the nodes.
        iterations: How many were made.
    """

    theta: Array
    nodes: Array
    costs: Array
    merit: float
    cap: float
    residual: Array
    basis: Array
    by_knob: Array
    projected: Array
    slope: Slope
    iterations: int
    model: Model

    @property
    def weights(self) -> Array:
        """Weight of every window: less than one if its cost is above the cap, (W,)."""
        return np.minimum(1.0, self.cap / np.maximum(self.costs, 1e-300))


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
    if by_state is None:
        by_state = np.stack([(after[1 + i] - base) / moves[i, i] for i in range(width)], axis=-1)
    by_knob = np.zeros((n, width, p))
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


def fit(
    model: Model,
    samples: Samples,
    windows: Windows,
    nodes: Array,
    theta: Array,
    sigma: Array,
    scale: Array,
    iterations: int = 6,
    cap: float = np.inf,
    widths: float = 0.3,
    shrink: float = 0.35,
    by_state: Array | None = None,
    tolerance: float = 1e-3,
) -> Fit:
    """Gauss-Newton on start states and unknowns.

    Args:
        model: Simulator with effects.
        samples: The measured table.
        windows: Where nodes must follow each other.
        nodes: First guess of the state at every sample, (n, n_s).
        theta: First guess of the unknowns, (p,).
        sigma: Noise of every measured channel, (m,).
        scale: Typical variation of every state, (n_s,).
        iterations: At most this many.
        cap: Cost above which a window counts only by its logarithm.
        widths: First finite-difference width, in units of each unknown's scale; it shrinks by
            ``shrink`` in every iteration down to 0.005: large at first to see over the kinks of
            dead zones and friction, small at last to be unbiased.
        by_state: Derivatives by state to start with.
        tolerance: Stop when the merit falls by less than this.
    """
    free = model.free
    start = np.zeros((nodes.shape[1], len(free)))
    start[free, range(len(free))] = 1.0
    ridge = 1e-2 / scale[free]
    used = np.unique(windows.index[windows.inside])
    memory = np.array([i for i in range(nodes.shape[1]) if i not in free], int)
    best: Fit | None = None
    step_nodes = np.zeros_like(nodes)
    step_theta = np.zeros_like(theta)
    damping, made = 1e-6, 0
    for turn in range(iterations + 1):
        width = model.step * max(widths * shrink**turn, 0.005)
        slope = slopes(
            model, samples, nodes, theta, width, scale, by_state if turn == 0 else None, used
        )
        gaps = defects(samples, slope, nodes)
        response = carry(
            windows, slope.by_state, start, np.concatenate([slope.by_knob, gaps[..., None]], axis=2)
        )
        shown = observe(samples, windows, slope, response, sigma)
        f, p = len(free), len(theta)
        if p and model.has_sensor:
            measured = samples.measured
            extra = slope.shown_by_knob[:, measured][windows.index] / sigma[:, None]
            valid = (
                np.isfinite(samples.seen[:, measured])[windows.index] & windows.inside[..., None]
            )
            shown[..., f : f + p] += extra * valid[..., None]
        residual = misfit(samples, windows, slope, sigma) - shown[..., -1]
        count = len(windows)
        flat = residual.reshape(count, -1)
        columns = shown[..., :-1].reshape(count, flat.shape[1], f + p)
        costs = np.minimum((flat**2).sum(axis=1), 1e30)
        merit = capped(costs, cap)
        padded = np.concatenate(
            [columns[..., :f], np.broadcast_to(np.diag(ridge), (count, f, f))], axis=1
        )
        basis, triangle = np.linalg.qr(padded)
        basis_rows = basis[:, : flat.shape[1]]
        inner = basis_rows.transpose(0, 2, 1)
        projected = flat - (basis_rows @ (inner @ flat[..., None]))[..., 0]
        by_knob = columns[..., f:] - basis_rows @ (inner @ columns[..., f:])
        better = best is None or merit < best.merit
        finished = better and best is not None and best.merit - merit < tolerance
        if better:
            best = Fit(
                theta, nodes, costs, merit, cap, residual, basis_rows, by_knob, projected, slope,
                turn, model,
            )  # fmt: skip
            made = 0
        elif made >= 4:
            break
        if turn == iterations or (finished and turn >= min(iterations, 4)):
            break
        if not better and best is not None:
            # Back along the last step: the same direction, shorter.
            made += 1
            factor = 0.3**made
            nodes, theta = best.nodes + factor * step_nodes, best.theta + factor * step_theta
            continue
        weight = np.minimum(1.0, cap / np.maximum(costs, 1e-300))
        step_theta = _step(by_knob, projected, weight, theta, model, damping)
        target = flat - columns[..., f:] @ step_theta
        padded_target = np.concatenate([target, np.zeros((count, f))], axis=1)
        right = basis.transpose(0, 2, 1) @ padded_target[..., None]
        first = np.linalg.solve(triangle, right)[..., 0]
        limit = 3 * scale[free]
        first = first * np.minimum(1.0, (limit / np.maximum(np.abs(first), 1e-300)).min(1))[:, None]
        moves = (
            (response[..., :f] @ first[:, None, :, None])[..., 0]
            + response[..., f : f + p] @ step_theta
            + response[..., -1]
        )
        step_nodes = np.zeros_like(nodes)
        step_nodes[windows.index[windows.inside]] = moves[windows.inside]
        if len(memory):
            for a, b in samples.runs:
                fresh = np.setdiff1d(windows.index[:, 0], [a])
                fresh = fresh[(fresh > a) & (fresh < b)]
                step_nodes[np.ix_(fresh, memory)] = (
                    slope.after[np.ix_(fresh - 1, memory)] - nodes[np.ix_(fresh, memory)]
                )
        nodes, theta = nodes + step_nodes, theta + step_theta
    assert best is not None
    return best


def capped(costs: Array, cap: float) -> float:
    """Sum of costs, those above the cap counted by their logarithm."""
    if not np.isfinite(cap):
        return float(costs.sum())
    return float(
        np.where(costs > cap, cap * (1 + np.log(np.maximum(costs, cap) / cap)), costs).sum()
    )


def _step(
    by_knob: Array, projected: Array, weight: Array, theta: Array, model: Model, damping: float
) -> Array:
    """Gauss-Newton step of the unknowns within their bounds."""
    p = len(theta)
    step = np.zeros(p)
    if p == 0:
        return step
    rows = by_knob * np.sqrt(weight)[:, None, None]
    aims = projected * np.sqrt(weight)[:, None]
    matrix = np.einsum("wri,wrj->ij", rows, rows)
    right = np.einsum("wri,wr->i", rows, aims)
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    matrix = matrix / np.outer(size, size) + damping * np.eye(p)
    right = right / size
    limit = 10 * model.step + np.abs(theta)
    low = np.maximum(model.low - theta, -limit)
    high = np.minimum(model.high - theta, limit)
    active = np.zeros(p, bool)
    for _ in range(p + 1):
        loose = ~active
        if not loose.any():
            break
        shift = right[loose] - matrix[np.ix_(loose, active)] @ (step[active] * size[active])
        step[loose] = (
            np.linalg.lstsq(matrix[np.ix_(loose, loose)], shift, rcond=None)[0] / size[loose]
        )
        out = loose & ((step < low) | (step > high))
        if not out.any():
            break
        step[out] = np.clip(step[out], low[out], high[out])
        active |= out
    return np.clip(step, low, high)
