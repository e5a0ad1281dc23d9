"""Integration check: what changes with the step or the input hold is not physics."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from residual.gap.model import Model
from residual.gap.samples import Samples
from residual.gap.search import Found
from residual.gap.shooting import Fit, fit
from residual.gap.windows import Windows

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class Integration:
    """Strengths refitted at half the step and under the other input hold.

    Attributes:
        fine: Unknowns with twice the sub-steps.
        fine_merit: Cost with twice the sub-steps.
        held: Unknowns under the other hold.
        held_merit: Cost under the other hold.
        nominal_held_merit: Cost of the nominal simulator under the other hold.
    """

    fine: Array
    fine_merit: float
    held: Array
    held_merit: float
    nominal_held_merit: float


def integration(found: Found, most_windows: int | None = None) -> Integration:
    """Refit the chosen effects on the same windows with other numerics."""
    arena, best = found.arena, found.fit
    windows = arena.windows
    if most_windows is not None and len(windows) > most_windows:
        windows = Windows.cut(windows.pieces[:: int(np.ceil(len(windows) / most_windows))])
    model = best.model
    scale = model.scales(arena.scale)

    def again(model: Model, samples: Samples, start: Array, theta: Array) -> Fit:
        return fit(model, samples, windows, start, theta, arena.sigma, scale, 4, arena.cap, 0.02)

    finer = dataclasses.replace(arena.samples, substeps=2 * arena.samples.substeps)
    other = dataclasses.replace(
        arena.samples, hold="linear" if arena.samples.hold == "zero" else "zero"
    )
    fine = again(model, finer, best.nodes, best.theta)
    held = again(model, other, best.nodes, best.theta)
    nominal = arena.tried[()]
    plain = fit(
        nominal.model, other, windows, nominal.nodes, nominal.theta, arena.sigma,
        nominal.model.scales(arena.scale), 4, arena.cap,
    )  # fmt: skip
    return Integration(fine.theta, fine.merit, held.theta, held.merit, plain.merit)
