"""Fit of effects and of the free start state of every window (multiple shooting, lifted).

Every sample has its own state, a node; windows only demand that nodes follow each other. A step
of Gauss-Newton then needs one sample interval from every node, all in one batch, and no window
can run away: the nodes start at the measured path. The continuity defects are condensed out, so
the unknowns are the effects' numbers and one start state for each window, and the start states
are projected out (variable projection). At convergence the result is that of single shooting
over each window. With no unknowns left every window is on its own, and goes back along its own
step if that was too long. Source: Albersmeyer and Diehl, "The lifted Newton method and its
application in optimization", SIAM J. Optim. 20 (2010).
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.samples import Samples
from residual.gap.data.windows import Windows, carry
from residual.gap.fitting.bounded import bounded_step
from residual.gap.model.model import Model
from residual.gap.model.slopes import Slope, defects, misfit, observe, slopes

Array = NDArray[np.float64]

#: How far nodes, in their scale, and unknowns, as a share, may be from where derivatives by the
#: state were taken.
NEAR = 0.03


@dataclasses.dataclass(frozen=True)
class ShootingFit:
    """Result of fitting a model to windows.

    Attributes:
        theta: Unknowns, (p,).
        nodes: State at every sample of the table, (n, n_s).
        costs: Whitened squared residual of every window, (W,).
        merit: Sum of the costs, those above ``cap`` counted as cap (1 + log(cost / cap)).
        cap: See ``merit``.
        residual: Whitened residual, (W, L, m), zero where nothing was measured.
        basis: Orthonormal basis of what start states can imitate, (W, L m, f).
        by_knob: Its derivative by the unknowns, start states projected out, (W, L m, p).
        projected: The residual with start states projected out, (W, L m).
        slope: Derivatives at the nodes.
        converged: Whether the last iteration no longer lowered the merit.
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
    model: Model
    converged: bool = False

    @property
    def weights(self) -> Array:
        """Weight of every window: less than one if its cost is above the cap, (W,)."""
        return np.minimum(1.0, self.cap / np.maximum(self.costs, 1e-300))


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
    tolerance: float = 1e-4,
) -> ShootingFit:
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
        tolerance: Stop when the merit falls by less than this share of it.
    """
    count, f, p = len(windows), len(model.free), len(theta)
    problem = _Problem(model, samples, windows, sigma, scale, cap)
    best: ShootingFit | None = None
    moves = np.zeros((*windows.index.shape, nodes.shape[1]))
    step_theta = np.zeros_like(theta)
    damping, failed = 1e-6, np.zeros(count, int)
    known: tuple[Array, Array, Array] | None = None
    for turn in range(iterations + 1):
        width = model.step * max(widths * shrink**turn, 0.005)
        if turn and known is not None and not problem.near(nodes, theta, *known[:2]):
            known = None
        given = known[2] if known else by_state if turn == 0 else None
        now, tangent = problem.at(nodes, theta, width, given)
        if given is None:
            known = (nodes, theta, now.slope.by_state)
        if best is None:
            better, finished = np.ones(count, bool), False
            best = now
        else:
            better = now.costs < best.costs if p == 0 else np.full(count, now.merit < best.merit)
            merged = _merge(best, now, better, windows)
            gained = best.merit - merged.merit
            finished = bool(better.any()) and gained < tolerance * merged.merit
            best = merged
        failed = np.where(better, 0, failed + 1)
        if (failed > 4).all():
            break
        if turn == iterations or (finished and turn >= min(iterations, 4)):
            break
        if better.any():
            if p:
                weight = np.minimum(1.0, cap / np.maximum(now.costs, 1e-300))
                step_theta = _step(now.by_knob, now.projected, weight, theta, model, damping)
            target = tangent.flat - tangent.columns[..., f:] @ step_theta
            padded = np.concatenate([target, np.zeros((count, f))], axis=1)
            right = tangent.basis.transpose(0, 2, 1) @ padded[..., None]
            first = np.linalg.solve(tangent.triangle, right)[..., 0]
            limit = 3 * scale[model.free]
            short = (limit / np.maximum(np.abs(first), 1e-300)).min(1)
            first = first * np.minimum(1.0, short)[:, None]
            fresh = (
                (tangent.response[..., :f] @ first[:, None, :, None])[..., 0]
                + tangent.response[..., f : f + p] @ step_theta
                + tangent.response[..., -1]
            )
            moves[better] = fresh[better]
        # Back along the last step where it failed: the same direction, shorter.
        factor = np.where(failed > 4, 0.0, 0.3**failed)
        nodes = best.nodes.copy()
        nodes[windows.index[windows.inside]] += (factor[:, None, None] * moves)[windows.inside]
        theta = best.theta + (factor[0] * step_theta if p else 0.0)
    assert best is not None
    return dataclasses.replace(best, converged=finished or bool((failed > 4).all()))


@dataclasses.dataclass(frozen=True)
class _Tangent:
    """What a step is computed from: see ``_Problem.at``."""

    response: Array
    columns: Array
    flat: Array
    basis: Array
    triangle: Array


class _Problem:
    """The fit of one model to windows; arguments as for ``fit``."""

    def __init__(
        self, model: Model, samples: Samples, windows: Windows, sigma: Array, scale: Array,
        cap: float,
    ) -> None:  # fmt: skip
        self.model, self.samples, self.windows = model, samples, windows
        self.sigma, self.scale, self.cap = sigma, scale, cap
        free, size = model.free, len(scale)
        self.start = np.zeros((size, len(free)))
        self.start[free, range(len(free))] = 1.0
        self.ridge = 1e-2 / scale[free]
        self.used = np.unique(windows.index[windows.inside])
        # Memory is not free at a window's start: the interval before it tells.
        self.memory = np.array([i for i in range(size) if i not in free], int)
        first = windows.index[:, 0]
        self.follows = np.flatnonzero(~np.isin(first, [start for start, _ in samples.runs]))
        self.before = first[self.follows] - 1
        if len(self.memory):
            self.used = np.union1d(self.used, self.before)

    def near(self, nodes: Array, theta: Array, others: Array, before: Array) -> bool:
        """Whether derivatives by the state at other nodes and unknowns serve here, too."""
        moved = np.abs(nodes - others)[self.used] / self.scale
        grown = np.abs(theta - before) / np.maximum(np.abs(before), self.model.step)
        return bool((moved < NEAR).all() and (grown < NEAR).all())

    def at(
        self, nodes: Array, theta: Array, width: Array, by_state: Array | None
    ) -> tuple[ShootingFit, _Tangent]:
        """Costs and their linearisation at nodes and unknowns."""
        model, samples, windows, sigma = self.model, self.samples, self.windows, self.sigma
        f, p, count = len(model.free), len(theta), len(windows)
        slope = slopes(model, samples, nodes, theta, width, self.scale, by_state, self.used)
        gaps = defects(samples, slope, nodes)
        acting = np.concatenate([slope.by_knob, gaps[..., None]], axis=2)
        begun = np.zeros((count, *acting.shape[1:]))
        begun[np.ix_(self.follows, self.memory)] = acting[np.ix_(self.before, self.memory)]
        response = carry(windows, slope.by_state, self.start, acting, begun)
        shown = observe(samples, windows, slope, response, sigma)
        if p and model.has_sensor:
            measured = samples.measured
            extra = slope.shown_by_knob[:, measured][windows.index] / sigma[:, None]
            valid = (
                np.isfinite(samples.seen[:, measured])[windows.index] & windows.inside[..., None]
            )
            shown[..., f : f + p] += extra * valid[..., None]
        residual = misfit(samples, windows, slope, sigma) - shown[..., -1]
        flat = residual.reshape(count, -1)
        columns = shown[..., :-1].reshape(count, flat.shape[1], f + p)
        with np.errstate(over="ignore"):  # what runs away costs no less for being capped
            costs = np.minimum((flat**2).sum(axis=1), 1e30)
        ridges = np.broadcast_to(np.diag(self.ridge), (count, f, f))
        basis, triangle = np.linalg.qr(np.concatenate([columns[..., :f], ridges], axis=1))
        basis_rows = basis[:, : flat.shape[1]]
        inner = basis_rows.transpose(0, 2, 1)
        projected = flat - (basis_rows @ (inner @ flat[..., None]))[..., 0]
        by_knob = columns[..., f:] - basis_rows @ (inner @ columns[..., f:])
        found = ShootingFit(
            theta, nodes, costs, float(capped(costs, self.cap).sum()), self.cap, residual,
            basis_rows, by_knob, projected, slope, model,
        )  # fmt: skip
        return found, _Tangent(response, columns, flat, basis, triangle)


def _merge(
    old: ShootingFit, new: ShootingFit, better: NDArray[np.bool_], windows: Windows
) -> ShootingFit:
    """The new fit in the windows where it is better, elsewhere the old one."""
    if better.all():
        return new
    if not better.any():
        return old
    rows = windows.index[better][windows.inside[better]]

    def taken(mine: Array, its: Array, where: NDArray[np.generic]) -> Array:
        joined = mine.copy()
        joined[where] = its[where]
        return joined

    slope = {
        field.name: taken(getattr(old.slope, field.name), getattr(new.slope, field.name), rows)
        for field in dataclasses.fields(Slope)
    }
    by_window = ("costs", "residual", "basis", "by_knob", "projected")
    parts: dict[str, Any] = {
        name: taken(getattr(old, name), getattr(new, name), better) for name in by_window
    }
    return dataclasses.replace(
        new,
        nodes=taken(old.nodes, new.nodes, rows),
        merit=float(capped(parts["costs"], new.cap).sum()),
        slope=Slope(**slope),
        **parts,
    )


def capped(costs: Array, cap: float) -> Array:
    """Costs, those above the cap counted by their logarithm; shapes broadcast."""
    if not np.isfinite(cap):
        return costs
    return np.where(costs > cap, cap * (1 + np.log(np.maximum(costs, cap) / cap)), costs)


def _step(
    by_knob: Array, projected: Array, weight: Array, theta: Array, model: Model, damping: float
) -> Array:
    """Gauss-Newton step of the unknowns within their bounds.

    What is known of a number beforehand counts as an observation.
    """
    if len(theta) == 0:
        return np.zeros(0)
    rows = by_knob * np.sqrt(weight)[:, None, None]
    aims = projected * np.sqrt(weight)[:, None]
    weight_of_known = model.known**-2
    return bounded_step(
        np.einsum("wri,wrj->ij", rows, rows) + np.diag(weight_of_known),
        np.einsum("wri,wr->i", rows, aims) - weight_of_known * theta,
        *model.room(theta),
        damping,
    )
