"""Fit of the strengths of some effects together with the start state of every window."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from residual.gap.fitting.impacts.columns import SOME, WIDE, Slopes, slopes
from residual.gap.fitting.impacts.quadratic import Quadratic, minimise
from residual.gap.fitting.impacts.robust import losses
from residual.gap.fitting.impacts.single_shooting import (
    StartFit,
    WindowData,
    foretold,
)
from residual.gap.fitting.impacts.start_states import (
    begun,
    begun_beside,
    descend,
    fit_starts,
    renewed,
)
from residual.gap.model.model import Model

Array = NDArray[np.float64]

#: Samples of the shortest part of a window that is followed, and how much longer the next one is.
SHORTEST, LONGER = 7, 1.5
#: Share by which the loss must fall for another step.
SETTLED = 3e-3
#: Share by which a step must lower the loss for a longer one to be tried.
WORTH_MORE = 0.03


@dataclasses.dataclass(frozen=True)
class Refined:
    """A model fitted to windows.

    Attributes:
        model: Simulator with the effects.
        theta: Their numbers, (p,).
        fitted: The windows, fitted by their best start states.
        ahead: Residual of what was foretold from these, (W, R'); empty if that is not asked for.
        freedom: Measured values less free states of every window, (W,).
        slopes: Derivative by the numbers, there or a step before; None if there was no step.
    """

    model: Model
    theta: Array
    fitted: StartFit
    ahead: Array
    freedom: Array
    slopes: Slopes | None = None

    @classmethod
    def of(cls, model: Model, theta: Array, fitted: StartFit, data: WindowData) -> Refined:
        """A model whose start states have been found."""
        return cls(model, theta, fitted, _ahead(model, theta, data, fitted), data.freedom)

    def tried_from(self, other: StartFit, data: WindowData) -> Refined:
        """The same strengths, with every window begun as in another fit where that is better."""
        model, theta = self.model, self.theta
        begin = begun(model, theta, data, other.starts, other.by_start)
        found = descend(model, theta, data, begin, SOME)
        trial = Refined.of(model, theta, found, data)
        won = np.flatnonzero(trial.loss < self.loss)
        if not len(won):
            return self
        part, ahead = data.take(won), self.ahead.copy()
        better = renewed(model, theta, part, found.take(won))
        ahead[won] = trial.ahead[won]
        return dataclasses.replace(self, fitted=self.fitted.with_windows(won, better), ahead=ahead)

    def with_better(self, other: Refined) -> Refined:
        """The same strengths, with the windows that another fit of them has begun better: so that
        they and what follows err less together."""
        won = np.flatnonzero(other.loss < self.loss)
        fitted = self.fitted.with_windows(won, other.fitted.take(won))
        ahead = self.ahead.copy()
        ahead[won] = other.ahead[won]
        return dataclasses.replace(self, fitted=fitted, ahead=ahead)

    @property
    def loss(self) -> Array:
        """Robust loss of every window and of what follows it, (W,)."""
        own = losses(self.fitted.costs, self.freedom)
        return own + losses(self.costs_ahead, self.freedom)

    @property
    def costs_ahead(self) -> Array:
        """Squared residual of what follows every window, (W,)."""
        return (self.ahead**2).sum(axis=1)

    @property
    def total(self) -> float:
        """Sum of the losses."""
        return float(self.loss.sum())


def _ahead(model: Model, theta: Array, data: WindowData, fitted: StartFit) -> Array:
    if data.ahead is None:
        return np.zeros((len(data), 0))
    shown = foretold(model, theta, data, fitted.starts, data.ahead.steps)
    return data.ahead.residual(data, shown)


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


def improved(best: Refined, data: WindowData, turns: int, width: float = WIDE) -> Refined:
    """At most so many steps of a fit, while the loss falls by more than a share."""
    for _ in range(turns if len(best.theta) else 0):
        fresh = step(best, data, width)
        gain = best.total - fresh.total
        if gain > 0:
            fitted = renewed(fresh.model, fresh.theta, data, fresh.fitted)
            best = dataclasses.replace(fresh, fitted=fitted)
        else:
            best = dataclasses.replace(best, slopes=fresh.slopes)
        if gain < SETTLED * best.total:
            break
    return best


def level(one: Refined, other: Refined, data: WindowData) -> tuple[Refined, Array]:
    """A fit after it has tried another's start states, and by how much it is better, (W,).

    A start state is found by search, and to go on searching lowers the loss of any model. So the
    other one tries the start states of this one, too, before losses are compared.
    """
    one = one.tried_from(other.fitted, data)
    return one, other.tried_from(one.fitted, data).loss - one.loss


def quadratic(found: Refined, data: WindowData, changes: Slopes) -> Quadratic:
    """The windows and what follows them as quadratic functions of changes of the strengths."""
    fitted, low = found.fitted, found.model.low - found.theta
    own = Quadratic.of(fitted.by_start, fitted.residual, changes.window, data.freedom, low)
    return own if data.ahead is None else own.beside(found.ahead, changes.ahead)


def newton(found: Refined, data: WindowData, changes: Slopes | None = None) -> Array:
    """Full step of the strengths by the quadratic model, within their bounds, (p,)."""
    model = found.model
    if changes is None:
        changes = slopes(model, found.theta, data, found.fitted, found.ahead)
    _, (change,) = minimise(quadratic(found, data, changes), [tuple(range(len(model)))])
    return np.clip(found.theta + change, model.low, model.high) - found.theta


def step(best: Refined, data: WindowData, width: float = WIDE) -> Refined:
    """Strengths and start states a step of Gauss and Newton further, a part or a multiple of it;
    the derivative by start states stays that of before.

    Kinks make derivatives noisy, and noisy derivatives make steps too short, so a step that pays
    is doubled while it does.
    """
    model, fitted = best.model, best.fitted
    changes = slopes(model, best.theta, data, fitted, best.ahead, width)
    full = newton(best, data, changes)

    def at(share: float) -> Refined:
        theta = np.clip(best.theta + share * full, model.low, model.high)
        begin = begun_beside(model, theta, data, fitted, changes.window @ (theta - best.theta))
        return Refined.of(model, theta, descend(model, theta, data, begin), data)

    reached = at(1.0)
    gain = best.total - reached.total
    shares = (2.0, 4.0, 8.0) if gain > 0 else (0.4, 0.15)
    for share in shares if gain < 0 or gain > WORTH_MORE * best.total else ():
        trial = at(share)
        better = trial.total < reached.total
        reached = trial if better else reached
        if better != (share > 1):
            break
    return dataclasses.replace(reached, slopes=changes)
