"""Numbers of effects that hold still what hardly moves: sought globally, since slopes mislead.

Where friction holds a joint or a dead zone an input, the times at which motion begins and stops
jump with the numbers, and where nothing moves no number matters: the method of Gauss and Newton
ends in one of many local minima. Differential evolution on forecasts of whole windows finds where
to begin. Source: Storn and Price, "Differential evolution", J. Global Optimization 11 (1997).
"""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import differential_evolution

from residual.gap.fitting import Fit, Fitter
from residual.gap.model import Model
from residual.gap.smooth import LOST, SmoothFitter

Array = NDArray[np.float64]

#: Part of the time for searching, at most.
GLOBALLY = 0.2
#: Residual over noise from which on a fit may have ended in a wrong minimum.
FAR = 3.0
#: Vectors of numbers in a generation, and generations, for every number.
POPULATION, GENERATIONS = 12, 5
#: Members of the last generation that fits begin from, and how far they are apart, as a share of
#: the reach of a number.
STARTS, NEAR = 8, 0.1
#: Windows that are foretold, at most: what is found is only where a fit begins.
WINDOWS = 16
#: Most numbers that are sought at once: larger sets grow from smaller ones.
MOST = 5
#: Reach of a size that is not negative: parts and multiples of its scale.
SMALLEST, LARGEST = 0.03, 100.0
#: Reach of what has a sign, in scales: of what cannot fall below some value, and of other numbers.
LESS, MORE, EITHER = 0.7, 2.5, 10.0


class GlobalSearch:
    """Fits from numbers that were sought globally, for a part of the time.

    Args:
        noise: Of every measured channel, (m,): what leaves much more may be sought globally; None
            to seek nothing.
        until: When searching ends, on the clock of ``time.process_time``.
    """

    def __init__(self, noise: Array | None, until: float) -> None:
        self.noise, self.until = noise, until
        self._left = GLOBALLY * (until - time.process_time())

    def better(self, fitter: Fitter, found: Fit, free: int) -> Fit:
        """A fit, or the same set's from elsewhere where that is better.

        Args:
            fitter: Holds the windows.
            found: The fit by slopes.
            free: How many of its numbers, from the first on, are sought; the others stay.
        """
        if self.noise is None or not isinstance(fitter, SmoothFitter):
            return found
        begun = time.process_time()
        if begun > self.until or self._left < 0:
            return found
        starts = begins_elsewhere(fitter, found, self.noise, free)
        fits = [fitter.fit(found.model, start, found) for start in starts]
        self._left -= time.process_time() - begun
        return min([found, *fits], key=lambda fit: fit.merit)


def begins_elsewhere(fitter: SmoothFitter, fit: Fit, noise: Array, free: int) -> Array:
    """Numbers from which a fit may do better, (k, p), most promising first; none if there is no
    reason to look.

    They are several, since forecasts of a few windows do not tell the valleys of a law apart that
    a fit to all of them does.

    Args:
        fitter: Holds the windows.
        fit: The fit by slopes.
        noise: Noise of every measured channel, (m,).
        free: How many of its numbers, from the first on, are sought; the others stay.
    """
    model = fit.model
    holds = any(candidate.effect.holds_still for candidate in model.chosen)
    own_step = model.batched and not model.simulator.own_files()
    if not (holds and own_step and 0 < free <= MOST and _far(fitter, fit, noise)):
        return np.zeros((0, len(fit.theta)))
    forecasts = _Forecasts(fitter, model)
    low, high, log = _box(model, fit.theta, free)

    def numbers(points: Array) -> Array:
        """(V, free) in the space of the search -> (V, p)."""
        found = np.repeat(fit.theta[None], len(points), axis=0)
        found[:, :free] = np.where(log, np.exp(np.where(log, points, 0.0)), points)
        return np.clip(found, model.low, model.high)

    begin = np.where(log, np.log(np.maximum(fit.theta[:free], 1e-300)), fit.theta[:free])
    inside = 1e-6 * (high - low)  # a bound itself may be outside by rounding
    result = differential_evolution(
        lambda points: forecasts.misses(numbers(points.T)), list(zip(low, high, strict=True)),
        vectorized=True, updating="deferred", polish=False, tol=0.0, rng=0,
        popsize=POPULATION, maxiter=GENERATIONS * free,
        x0=np.clip(begin, low + inside, high - inside),
    )  # fmt: skip
    ranked = result.population[np.argsort(result.population_energies)]
    return numbers(_apart(ranked, NEAR * (high - low)))


def _apart(points: Array, near: Array) -> Array:
    """The first of some points, (n, d), and up to ``STARTS`` in all that are not near another."""
    found = points[:1]
    for point in points[1:]:
        if len(found) < STARTS and (np.abs(found - point) > near).any(axis=1).all():
            found = np.vstack([found, point])
    return found


def _far(fitter: SmoothFitter, fit: Fit, noise: Array) -> bool:
    """Whether a fit leaves much more than noise."""
    windows = fitter.blocks.windows
    square = fit.projected.reshape(*windows.index.shape, -1) ** 2
    count = np.maximum(fitter.valid.sum(axis=(0, 1)), 1)
    left = np.sqrt(square.sum(axis=(0, 1)) / count) * fitter.sigma
    return bool((left > FAR * noise).any())


def _box(model: Model, theta: Array, free: int) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Least and greatest of every number, and which are sought by their logarithm, (free,) each."""
    scale, low, high = 10 * model.step[:free], model.low[:free], model.high[:free]
    begin = theta[:free]
    log = low >= 0
    least = np.maximum(np.maximum(low, SMALLEST * scale), 1e-300)
    most = np.minimum(high, LARGEST * scale)
    one_sided = np.isfinite(low)
    down = np.where(one_sided, -LESS, -EITHER) * scale
    up = np.where(one_sided, MORE, EITHER) * scale
    down = np.maximum(np.minimum(down, begin), low)
    up = np.minimum(np.maximum(up, begin), high)
    most = np.maximum(most, least * (1 + 1e-6))
    return np.where(log, np.log(least), down), np.where(log, np.log(most), up), log


class _Forecasts:
    """Forecasts of windows from the measured path's own states."""

    def __init__(self, fitter: SmoothFitter, model: Model) -> None:
        windows, samples = fitter.blocks.windows, fitter.samples
        places = np.linspace(0, len(windows) - 1, min(len(windows), WINDOWS))
        chosen = np.unique(places.round().astype(int))
        self.fitter, self.model = fitter, model
        self.rows = windows.index[chosen, 0]
        self.steps = windows.index.shape[1] - 1
        self.seen = samples.seen[windows.index[chosen]][..., samples.measured]
        self.valid = fitter.valid[chosen]
        self.limit = LOST * np.nanstd(samples.seen[:, samples.measured], axis=0)

    def misses(self, thetas: Array) -> Array:
        """Logarithm of the squared error of forecasts by each vector of numbers, (V,)."""
        model, samples, count = self.model, self.fitter.samples, len(self.rows)
        nodes = self.fitter.nodes
        if model.width == model.physical:
            states = np.tile(nodes[self.rows], (len(thetas), 1))
        else:
            states = np.vstack([model.widen(samples, nodes, t)[self.rows] for t in thetas])
        path = self.fitter.shown(
            model, np.tile(self.rows, len(thetas)), states, self.steps, thetas,
            np.repeat(np.arange(len(thetas)), count),
        ).reshape(len(thetas), *self.seen.shape)  # fmt: skip
        gap = np.where(np.isfinite(path), self.seen - path, self.limit)
        gap = np.where(self.valid, np.clip(gap, -self.limit, self.limit) / self.fitter.sigma, 0.0)
        return np.asarray(np.log((gap**2).sum(axis=(1, 2, 3)) + 1e-300))
