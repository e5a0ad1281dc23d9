"""Fit of the strengths of some effects together with the start state of every window."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from residual.gap.impacts.columns import chosen_changes
from residual.gap.impacts.quadratic import Quadratic, minimise
from residual.gap.impacts.robust import losses
from residual.gap.impacts.single_shooting import (
    StartFit,
    WindowData,
    fit_starts,
    residual,
    simulate,
)
from residual.gap.model import Model

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class Refined:
    """A model fitted to windows.

    Attributes:
        model: Simulator with the effects.
        theta: Their numbers, (p,).
        fitted: The windows inner from their best start states.
        loss: Robust loss of every window, (W,).
    """

    model: Model
    theta: Array
    fitted: StartFit
    loss: Array

    def with_better(self, again: Refined) -> Refined:
        """The better of two fits of the same strengths, window by window."""
        won = again.loss < self.loss
        mine, theirs = self.fitted, again.fitted
        fitted = StartFit(
            *(
                np.where(won.reshape(-1, *([1] * (a.ndim - 1))), b, a)
                for a, b in (
                    (mine.starts, theirs.starts),
                    (mine.shown, theirs.shown),
                    (mine.residual, theirs.residual),
                    (mine.by_start, theirs.by_start),
                )
            )
        )
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


def renew(model: Model, theta: Array, data: WindowData, starts: Array, steps: int) -> Refined:
    """Full steps of the strengths, each from start states sought afresh from the same ones.

    Start states that have settled hold the strengths back: along the kinks of impacts a better
    strength looks worse at first, so that a descent from 2 % off ends 2 % off, and one that
    begins where another effect has settled ends far off.
    """
    for _ in range(steps if len(theta) else 0):
        theta = theta + newton(settle(model, theta, data, starts, 2), data)
    return settle(model, theta, data, starts, 2)


def level(one: Refined, other: Refined, data: WindowData) -> tuple[Refined, Refined]:
    """Both after they have tried each other's start states, so that neither wins by its search.

    A start state is found by search, and to go on searching lowers the loss of any set.
    """
    better = []
    for mine, theirs in ((one, other.fitted), (other, one.fitted)):
        again = settle(mine.model, mine.theta, data, theirs.starts, 1, theirs.by_start)
        better.append(mine.with_better(again))
    return better[0], better[1]


def refine(
    model: Model,
    theta: Array,
    data: WindowData,
    near: StartFit,
    turns: int = 3,
    settled: float = 3e-3,
) -> Refined:
    """Strengths and start states in turns, each turn from a fresh derivative of both.

    Args:
        theta: First guess of the strengths, (p,).
        near: The windows as inner by a similar model.
        turns: At most so many.
        settled: Stop when the loss falls by a smaller share.
    """
    theta = np.clip(theta, model.low, model.high)
    best = settle(model, theta, data, near.starts, 1, near.by_start)
    for _ in range(turns if len(theta) else 0):
        strengths, starts = step(best, data)
        fresh = settle(model, strengths, data, starts, 1, best.fitted.by_start)
        gain = best.total - fresh.total
        if gain > 0:
            best = fresh
        if gain < settled * best.total:
            break
    return best


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


def step(found: Refined, data: WindowData) -> tuple[Array, Array]:
    """Strengths and start states a step of Gauss and Newton further, or a part of it."""
    model, fitted = found.model, found.fitted
    changes = chosen_changes(model, found.theta, data, fitted)
    full = newton(found, data, changes)
    inverse = np.linalg.pinv(fitted.by_start, rcond=1e-8)
    shares = (1.0, 0.4, 0.15)
    for share in shares:
        move = share * full
        target = fitted.residual - (changes @ move)
        options = np.stack([fitted.starts, fitted.starts + (inverse @ target[..., None])[..., 0]])
        outputs = simulate(model, found.theta + move, data, options)
        costs = np.stack(
            [(residual(data, *pair) ** 2).sum(1) for pair in zip(options, outputs, strict=True)]
        )
        # An impact may spoil the linear start of one window without spoiling the step.
        starts = np.where((costs[0] < costs[1])[:, None], options[0], options[1])
        if losses(costs.min(axis=0), data.freedom).sum() < found.total or share == shares[-1]:
            break
    return found.theta + move, starts
