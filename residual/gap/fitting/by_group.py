"""Numbers of a fit, one of which has a size of its own in every group of windows."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from residual.gap.fitting.bounded import bounded_step
from residual.gap.fitting.contract import Fit
from residual.gap.fitting.smooth import SmoothFitter

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Gauss-Newton steps in which sizes settle, and the part of the largest that they may still move.
STEPS, SETTLED = 5, 0.003


@dataclasses.dataclass(frozen=True)
class ByGroup:
    """What tells of such numbers, linear about a vector of them for every group.

    Attributes:
        fit: With one size for all.
        place: The number that differs.
        group: The group of every window, (W,).
        thetas: Numbers of every group, (G, p), alike but for that one.
        by_knob, projected, weights: As of a fit, of every window about its own group's.
    """

    fit: Fit
    place: int
    group: Integers
    thetas: Array
    by_knob: Array
    projected: Array
    weights: Array

    @classmethod
    def of(cls, fit: Fit, place: int, group: Integers) -> ByGroup:
        """About one size for all."""
        thetas = fit.theta[None].repeat(group.max() + 1, axis=0)
        return cls(fit, place, group, thetas, fit.by_knob, fit.projected, fit.weights)

    @property
    def loss(self) -> float:
        """Squared residuals, weighed."""
        return float((self.weights * (self.projected**2).sum(axis=1)).sum())

    def step(self, rows: NDArray[np.bool_]) -> Array:
        """Numbers of every group, (G, p), after one Gauss-Newton step.

        Args:
            rows: The windows that are fitted, (W,).
        """
        count, place = len(self.thetas), self.place
        apart = columns_apart(self.by_knob[..., [place]], self.group)
        columns = np.concatenate([np.delete(self.by_knob, place, axis=2), apart], axis=2)[rows]
        weights = self.weights[rows]
        rooms = [self.fit.model.room(theta) for theta in self.thetas]

        def spread(which: int) -> Array:
            own = [room[which][place] for room in rooms]
            return np.append(np.delete(rooms[0][which], place), own)

        step = bounded_step(
            np.einsum("wri,wrj,w->ij", columns, columns, weights),
            np.einsum("wri,wr,w->i", columns, self.projected[rows], weights),
            spread(0),
            spread(1),
        )
        found = self.thetas + np.insert(step[:-count], place, 0.0)
        found[:, place] += step[-count:]
        return found

    def about(self, fitter: SmoothFitter, thetas: Array) -> ByGroup:
        """The same about other numbers, along forecasts by them."""
        by_knob, projected = np.zeros_like(self.by_knob), np.zeros_like(self.projected)
        weights = np.zeros_like(self.weights)
        for number in np.unique(self.group):
            own = self.group == number
            part = dataclasses.replace(fitter, blocks=fitter.blocks.of(own), turns=0)
            there = part.from_forecasts(self.fit.model, thetas[number], self.fit)
            by_knob[own], projected[own] = there.by_knob, there.projected
            weights[own] = there.weights
        return dataclasses.replace(
            self, thetas=thetas, by_knob=by_knob, projected=projected, weights=weights
        )


def settled(fitter: SmoothFitter, found: ByGroup) -> ByGroup:
    """The same about the numbers of least loss, as far as steps lead down.

    A mass enters by its inverse: a single step from one size for all falls short of a record
    with half as much again.
    """
    every = np.ones(len(found.group), bool)
    for _ in range(STEPS):
        thetas = found.step(every)
        moved = np.abs(thetas - found.thetas)[:, found.place].max()
        if moved <= SETTLED * np.abs(thetas[:, found.place]).max():
            break
        there = found.about(fitter, thetas)
        if not there.loss < found.loss:
            break
        found = there
    return found


def columns_apart(columns: Array, group: Integers) -> Array:
    """Columns (W, R, 1) once for every group of windows and zero elsewhere, (W, R, G)."""
    return columns * (group[:, None] == np.arange(group.max() + 1))[:, None, :]
