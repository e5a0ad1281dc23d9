"""Costs of a model over windows, and their linearisation, at given nodes and unknowns.

See ``residual.gap.fitting.shooting`` for what nodes are.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.carrying import carry
from residual.gap.data.samples import Samples
from residual.gap.data.windows import Windows
from residual.gap.model.model import Model
from residual.gap.model.slopes import Slope, by_unknowns, defects, misfit, observe, slopes

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


@dataclasses.dataclass(frozen=True)
class Tangent:
    """What a step is computed from: see ``Problem.at``."""

    response: Array
    columns: Array
    flat: Array
    basis: Array
    triangle: Array


class Problem:
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

    def slope(self, nodes: Array, theta: Array, by_state: Array | None) -> Slope:
        """Values at nodes and unknowns, and their derivatives by the nodes."""
        return slopes(self.model, self.samples, nodes, theta, self.scale, by_state, self.used)

    def merit(self, nodes: Array, slope: Slope) -> float:
        """See ``ShootingFit``, where the values are known."""
        gaps = defects(self.samples, slope, nodes)[..., None]
        response = self._carried(slope, self.start[:, :0], gaps)
        shown = observe(self.samples, self.windows, slope, response, self.sigma)
        residual = misfit(self.samples, self.windows, slope, self.sigma) - shown[..., 0]
        return float(capped(_costs(residual.reshape(len(residual), -1)), self.cap).sum())

    def _carried(self, slope: Slope, start: Array, acting: Array) -> Array:
        """What starts and what acts at every step do along the windows, (W, L, n_s, f + q)."""
        begun = np.zeros((len(self.windows), *acting.shape[1:]))
        begun[np.ix_(self.follows, self.memory)] = acting[np.ix_(self.before, self.memory)]
        return carry(self.windows, slope.by_state, start, acting, begun)

    def at(
        self, nodes: Array, theta: Array, width: Array, slope: Slope
    ) -> tuple[ShootingFit, Tangent]:
        """Costs and their linearisation at nodes and unknowns."""
        model, samples, windows, sigma = self.model, self.samples, self.windows, self.sigma
        f, p, count = len(model.free), len(theta), len(windows)
        by_knob, shown_by_knob = by_unknowns(model, samples, slope, nodes, theta, width, self.used)
        gaps = defects(samples, slope, nodes)
        acting = np.concatenate([by_knob, gaps[..., None]], axis=2)
        response = self._carried(slope, self.start, acting)
        shown = observe(samples, windows, slope, response, sigma)
        if p and model.has_sensor:
            measured = samples.measured
            extra = shown_by_knob[:, measured][windows.index] / sigma[:, None]
            valid = (
                np.isfinite(samples.seen[:, measured])[windows.index] & windows.inside[..., None]
            )
            shown[..., f : f + p] += extra * valid[..., None]
        residual = misfit(samples, windows, slope, sigma) - shown[..., -1]
        flat = residual.reshape(count, -1)
        columns = shown[..., :-1].reshape(count, flat.shape[1], f + p)
        costs = _costs(flat)
        ridges = np.broadcast_to(np.diag(self.ridge), (count, f, f))
        basis, triangle = np.linalg.qr(np.concatenate([columns[..., :f], ridges], axis=1))
        basis_rows = basis[:, : flat.shape[1]]
        inner = basis_rows.transpose(0, 2, 1)
        projected = flat - (basis_rows @ (inner @ flat[..., None]))[..., 0]
        alone = columns[..., f:] - basis_rows @ (inner @ columns[..., f:])
        found = ShootingFit(
            theta, nodes, costs, float(capped(costs, self.cap).sum()), self.cap, residual,
            basis_rows, alone, projected, slope, model,
        )  # fmt: skip
        return found, Tangent(response, columns, flat, basis, triangle)


def _costs(flat: Array) -> Array:
    """Squares of whitened residuals (W, r) by window, (W,)."""
    with np.errstate(over="ignore"):  # what runs away costs no less for being capped
        return np.minimum((flat**2).sum(axis=1), 1e30)


def capped(costs: Array, cap: float) -> Array:
    """Costs, those above the cap counted by their logarithm; shapes broadcast."""
    if not np.isfinite(cap):
        return costs
    return np.where(costs > cap, cap * (1 + np.log(np.maximum(costs, cap) / cap)), costs)
