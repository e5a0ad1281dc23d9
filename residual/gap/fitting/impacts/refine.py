"""Fit of the strengths of some effects together with the start state of every window."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from residual.gap.fitting.impacts.columns import chosen_changes
from residual.gap.fitting.impacts.quadratic import Quadratic, minimise
from residual.gap.fitting.impacts.robust import losses
from residual.gap.fitting.impacts.single_shooting import (
    StartFit,
    WindowData,
    descend,
    fit_starts,
    residual,
    simulate,
)
from residual.gap.model.model import Model

Array = NDArray[np.float64]

#: Samples of the shortest part of a window that is followed, and how much longer the next one is.
SHORTEST, LONGER = 7, 1.5
#: Steps of start states at every trial of strengths.
TRIES = 5
#: Share by which the loss must fall for another step.
SETTLED = 3e-3


@dataclasses.dataclass(frozen=True)
class Refined:
    """A model fitted to windows.

    Attributes:
        model: Simulator with the effects.
        theta: Their numbers, (p,).
        fitted: The windows, fitted by their best start states.
        loss: Robust loss of every window, (W,).
    """

    model: Model
    theta: Array
    fitted: StartFit
    loss: Array

    def with_better(self, again: Refined) -> Refined:
        """The better of two fits of the same strengths, window by window."""
        won = again.loss < self.loss
        fitted = self.fitted.where(won, again.fitted)
        return dataclasses.replace(self, fitted=fitted, loss=np.where(won, again.loss, self.loss))

    @property
    def total(self) -> float:
        """Sum of the losses."""
        return float(self.loss.sum())


def settle(
    model: Model,
    theta: Array,
    data: WindowData,
    starts: Array,
    turns: int,
    slope: Array | None = None,
) -> Refined:
    """Start states alone, the strengths as they are; see ``fit_starts``."""
    fitted = fit_starts(model, theta, data, starts, turns, slope=slope)
    return Refined(model, theta, fitted, losses(fitted.costs, data.freedom))


def grown(model: Model, theta: Array, data: WindowData, starts: Array) -> Refined:
    """Strengths and start states on ever longer parts of the windows.

    Past an impact a window has many local minima, in its start state as in the strengths. Start
    states that follow a shorter part find the right one more often than measured ones do, and
    strengths that begin there are not held back by start states that have settled for others.

    Args:
        starts: Measured start states, (W, n_p).
    """
    length, size = data.windows.index.shape[1], SHORTEST
    while size < length:
        part = data.until(size)
        # Steps on short parts are cheap, and the shortest leave most to be mended.
        for _ in range(2 if 2 * size <= length or not len(theta) else 1):
            found = settle(model, theta, part, starts, 1)
            starts = found.fitted.starts
            theta = theta + newton(found, part) if len(theta) else theta
        size = int(np.ceil(LONGER * size))
    return settle(model, theta, data, starts, 2)


def refine(model: Model, theta: Array, data: WindowData, near: StartFit, turns: int) -> Refined:
    """Strengths and start states from those of a similar model, in turns, each from a fresh
    derivative of both.

    Args:
        theta: First guess of the strengths, (p,).
        near: The windows as fitted by a similar model.
        turns: At most so many.
    """
    return improved(settle(model, theta, data, near.starts, 1, near.by_start), data, turns)


def improved(best: Refined, data: WindowData, turns: int) -> Refined:
    """At most so many steps of a fit, while the loss falls by more than a share."""
    for _ in range(turns if len(best.theta) else 0):
        strengths, starts = step(best, data)
        fresh = settle(best.model, strengths, data, starts, 1, best.fitted.by_start)
        gain = best.total - fresh.total
        if gain > 0:
            best = fresh
        if gain < SETTLED * best.total:
            break
    return best


def level(one: Refined, other: Refined, data: WindowData) -> tuple[Refined, Array]:
    """A fit after it has tried another's start states, and by how much it is better, (W,).

    A start state is found by search, and to go on searching lowers the loss of any model. So the
    other one tries the start states of this one, too, before losses are compared.
    """
    theirs = other.fitted
    one = one.with_better(settle(one.model, one.theta, data, theirs.starts, 1, theirs.by_start))
    mine = one.fitted
    shown = simulate(other.model, other.theta, data, mine.starts[None])[0]
    begin = dataclasses.replace(mine, shown=shown, residual=residual(data, mine.starts, shown))
    again = descend(other.model, other.theta, data, begin, TRIES)
    loss = np.minimum(other.loss, losses(again.costs, data.freedom))
    return one, loss - one.loss


def quadratic(found: Refined, data: WindowData, changes: Array) -> Quadratic:
    """The windows as quadratic functions of changes (W, R, p) by the strengths."""
    fitted = found.fitted
    return Quadratic.of(
        fitted.by_start,
        fitted.residual,
        changes,
        data.freedom,
        found.model.low - found.theta,
    )


def newton(found: Refined, data: WindowData, changes: Array | None = None) -> Array:
    """Full step of the strengths by the quadratic model, within their bounds, (p,)."""
    model = found.model
    if changes is None:
        changes = chosen_changes(model, found.theta, data, found.fitted)
    _, (change,) = minimise(quadratic(found, data, changes), [tuple(range(len(model)))])
    return np.clip(found.theta + change, model.low, model.high) - found.theta


def step(best: Refined, data: WindowData) -> tuple[Array, Array]:
    """Strengths and start states a step of Gauss and Newton further, a part or a multiple of it.

    Kinks make derivatives noisy, and noisy derivatives make steps too short, so a step that pays
    is doubled while it does.
    """
    model, fitted = best.model, best.fitted
    changes = chosen_changes(model, best.theta, data, fitted)
    full = newton(best, data, changes)
    inverse = np.linalg.pinv(fitted.by_start, rcond=1e-8)

    def at(share: float) -> tuple[float, Array, Array]:
        theta = np.clip(best.theta + share * full, model.low, model.high)
        target = fitted.residual - changes @ (theta - best.theta)
        moved = fitted.starts + (inverse @ target[..., None])[..., 0]
        outputs = simulate(model, theta, data, np.stack([fitted.starts, moved]))
        stay, move = (
            StartFit(starts, output, residual(data, starts, output), fitted.by_start)
            for starts, output in zip((fitted.starts, moved), outputs, strict=True)
        )
        # An impact may spoil the linear start of one window without spoiling the step.
        start = stay.where(move.costs < stay.costs, move)
        found = descend(model, theta, data, start, TRIES)
        return float(losses(found.costs, data.freedom).sum()), theta, found.starts

    reached = at(1.0)
    shares = (2.0, 4.0, 8.0) if reached[0] < best.total else (0.4, 0.15)
    for share in shares:
        trial = at(share)
        better = trial[0] < reached[0]
        reached = trial if better else reached
        if better != (share > 1):
            break
    return reached[1], reached[2]
