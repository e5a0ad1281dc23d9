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
from residual.gap.data.windows import Windows
from residual.gap.fitting.bounded import bounded_step
from residual.gap.fitting.linearised import Problem, ShootingFit, capped
from residual.gap.model.model import Model
from residual.gap.model.slopes import Slope

Array = NDArray[np.float64]

#: How far a window's start may go in a step, in its scale, and times that after every step that
#: was one down.
RADIUS, WIDER = 3.0, 2.0


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
    problem = Problem(model, samples, windows, sigma, scale, cap)
    best: ShootingFit | None = None
    moves = np.zeros((*windows.index.shape, nodes.shape[1]))
    step_theta = np.zeros_like(theta)
    damping, failed, radius = 1e-6, np.zeros(count, int), RADIUS
    known: tuple[Array, Array, Array] | None = None
    for turn in range(iterations + 1):
        width = model.step * max(widths * shrink**turn, 0.005)
        if turn and known is not None and not problem.near(nodes, theta, *known[:2]):
            known = None
        given = known[2] if known else by_state if turn == 0 else None
        slope = problem.slope(nodes, theta, given)
        if given is None:
            known = (nodes, theta, slope.by_state)
        if best is None:
            now, tangent = problem.at(nodes, theta, width, slope)
            better, finished = np.ones(count, bool), False
            best = now
        elif p and not problem.merit(nodes, slope) < best.merit:
            # What is given up needs no derivatives by the unknowns, which cost most.
            better, finished = np.zeros(count, bool), False
        else:
            now, tangent = problem.at(nodes, theta, width, slope)
            better = now.costs < best.costs if p == 0 else np.full(count, now.merit < best.merit)
            merged = _merge(best, now, better, windows)
            gained = best.merit - merged.merit
            finished = bool(better.any()) and gained < tolerance * merged.merit
            best = merged
        failed = np.where(better, 0, failed + 1)
        radius = WIDER * radius if turn and better.all() else RADIUS
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
            limit = radius * scale[model.free]
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
