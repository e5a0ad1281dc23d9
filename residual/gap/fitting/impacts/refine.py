"""Fit of the strengths of some effects together with the start state of every window."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from residual.gap.fitting.impacts.columns import WIDE, chosen_changes
from residual.gap.fitting.impacts.quadratic import Quadratic, minimise
from residual.gap.fitting.impacts.robust import losses
from residual.gap.fitting.impacts.single_shooting import (
    StartFit,
    WindowData,
    begun,
    descend,
    fit_starts,
    renewed,
    residual,
    simulate,
)
from residual.gap.model.model import Model

Array = NDArray[np.float64]

#: Samples of the shortest part of a window that is followed, and how much longer the next one is.
SHORTEST, LONGER = 7, 1.5
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

    @classmethod
    def of(cls, model: Model, theta: Array, fitted: StartFit, data: WindowData) -> Refined:
        """A model whose start states have been found."""
        return cls(model, theta, fitted, losses(fitted.costs, data.freedom))

    def tried_from(self, starts: Array, slope: Array, data: WindowData) -> Refined:
        """The same strengths, with every window begun elsewhere where that is better.

        Args:
            starts: Other start states, (W, n_p).
            slope: Derivative by them, (W, R, n_p).
            data: The windows.
        """
        model, theta = self.model, self.theta
        found = descend(model, theta, data, begun(model, theta, data, starts, slope))
        loss = losses(found.costs, data.freedom)
        won = np.flatnonzero(loss < self.loss)
        if not len(won):
            return self
        better = renewed(model, theta, data.take(won), found.take(won))
        fitted = self.fitted.with_windows(won, better)
        return dataclasses.replace(self, fitted=fitted, loss=np.minimum(loss, self.loss))

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
    return Refined.of(model, theta, fit_starts(model, theta, data, starts, turns, slope), data)


def has_short_parts(data: WindowData) -> bool:
    """Whether windows are long enough to be followed in part before they are followed whole."""
    return bool(data.windows.index.shape[1] > SHORTEST)


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


def improved(best: Refined, data: WindowData, turns: int, width: float = WIDE) -> Refined:
    """At most so many steps of a fit, while the loss falls by more than a share."""
    for _ in range(turns if len(best.theta) else 0):
        fresh = step(best, data, width)
        gain = best.total - fresh.total
        if gain > 0:
            fitted = renewed(fresh.model, fresh.theta, data, fresh.fitted)
            best = dataclasses.replace(fresh, fitted=fitted)
        if gain < SETTLED * best.total:
            break
    return best


def level(one: Refined, other: Refined, data: WindowData) -> tuple[Refined, Array]:
    """A fit after it has tried another's start states, and by how much it is better, (W,).

    A start state is found by search, and to go on searching lowers the loss of any model. So the
    other one tries the start states of this one, too, before losses are compared.
    """
    one = one.tried_from(other.fitted.starts, other.fitted.by_start, data)
    mine = one.fitted
    begin = begun(other.model, other.theta, data, mine.starts, mine.by_start)
    again = descend(other.model, other.theta, data, begin)
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


def step(best: Refined, data: WindowData, width: float = WIDE) -> Refined:
    """Strengths and start states a step of Gauss and Newton further, a part or a multiple of it;
    the derivative by start states stays that of before.

    Kinks make derivatives noisy, and noisy derivatives make steps too short, so a step that pays
    is doubled while it does.
    """
    model, fitted = best.model, best.fitted
    changes = chosen_changes(model, best.theta, data, fitted, width)
    full = newton(best, data, changes)
    inverse = np.linalg.pinv(fitted.by_start, rcond=1e-8)

    def at(share: float) -> Refined:
        theta = np.clip(best.theta + share * full, model.low, model.high)
        target = fitted.residual - changes @ (theta - best.theta)
        moved = fitted.starts + (inverse @ target[..., None])[..., 0]
        outputs = simulate(model, theta, data, np.stack([fitted.starts, moved]))
        stay, move = (
            StartFit(starts, output, residual(data, starts, output), fitted.by_start)
            for starts, output in zip((fitted.starts, moved), outputs, strict=True)
        )
        # An impact may spoil the linear start of one window without spoiling the step.
        moves = np.flatnonzero(move.costs <= stay.costs)
        start = stay.with_windows(moves, move.take(moves))
        return Refined.of(model, theta, descend(model, theta, data, start), data)

    reached = at(1.0)
    shares = (2.0, 4.0, 8.0) if reached.total < best.total else (0.4, 0.15)
    for share in shares:
        trial = at(share)
        better = trial.total < reached.total
        reached = trial if better else reached
        if better != (share > 1):
            break
    return reached
