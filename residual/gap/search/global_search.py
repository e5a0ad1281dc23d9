"""Numbers of effects that hold still what hardly moves: sought globally, since slopes mislead.

Where friction holds a joint or a dead zone an input, the times at which motion begins and stops
jump with the numbers, and where nothing moves no number matters: the method of Gauss and Newton
ends in one of many local minima. (Friction of a joint that never stands still is left to it.)
Differential evolution on forecasts of whole windows finds where to begin: half of its first
generation lies about what slopes reached, the other half anywhere. Forecasts of parts of windows
come first: each start and stop counts by itself there, while over a whole window the first that is
missed decides.
Source: Storn and Price, "Differential evolution", J. Global Optimization 11 (1997).
"""

from __future__ import annotations

import itertools
import time

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import differential_evolution

from residual.gap.data.standstill import may_stick
from residual.gap.fitting.contract import Fit, Fitter
from residual.gap.fitting.short_forecasts import ShortForecasts
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.model.model import Model

Array = NDArray[np.float64]

#: Part of the time for searching, at most, and part of that for one set: where a fit takes a
#: second, fewer begin from elsewhere.
GLOBALLY, EACH = 0.3, 0.1
#: Part of its squared error that a fit keeps at most if seeking was of use, and how many sets it is
#: of no use to, one after the other, before it ends; how many of those another search has.
GAINED, IN_VAIN, ONCE_MORE = 0.9, 10, 3
#: Residual over noise from which on a fit may have ended in a wrong minimum.
FAR = 3.0
#: Vectors of numbers in a generation, and generations, for every number.
POPULATION, GENERATIONS = 12, 5
#: Parts that windows are foretold in each time that a set is sought, from the best fit so far.
PARTS = (8, 4)
#: How far the half of a first generation that lies about that fit is spread, as a share of the
#: reach of a number.
ABOUT = 0.07
#: Members of the last generation that fits begin from, and how far they are apart, as a share of
#: the reach of a number.
STARTS, NEAR = 8, 0.1
#: Most numbers that are sought at once: larger sets grow from smaller ones.
MOST = 5
#: Reach of a size that is not negative: parts and multiples of its scale.
SMALLEST, LARGEST = 0.03, 100.0
#: How many times as large as another number one is that does nothing below it, at most.
ABOVE = 30.0
#: Reach of what has a sign, in scales: of what cannot fall below some value and of gains, which
#: seldom do, and of other numbers.
LESS, MORE, EITHER = 0.7, 2.5, 10.0


class GlobalSearch:
    """Fits from numbers that were sought globally, for a part of the time, and while it is of use.

    Args:
        noise: Of every measured channel, (m,): what leaves much more may be sought globally; None
            to seek nothing.
        until: When searching ends, on the clock of ``time.process_time``.
    """

    def __init__(self, noise: Array | None, until: float) -> None:
        self.noise, self.until = noise, until
        self._left = GLOBALLY * (until - time.process_time())
        self._each = EACH * self._left
        self._in_vain = 0

    def after(self, earlier: GlobalSearch) -> None:
        """Know of what use it was in an earlier search of the same effects."""
        self._in_vain = min(earlier._in_vain, IN_VAIN - ONCE_MORE)

    def better(self, fitter: Fitter, found: Fit, free: int, begun_from: Array) -> Fit:
        """A fit, or the same set's from elsewhere where that is better.

        Args:
            fitter: Holds the windows.
            found: The fit by slopes.
            free: How many of its numbers, from the first on, are sought; the others stay.
            begun_from: Numbers that it began from, (p,): they may have been better.
        """
        if self.noise is None or not isinstance(fitter, SmoothFitter):
            return found
        by_slopes, sought = found.merit, False
        over = time.process_time() + min(self._each, max(self._left, 0.0))
        for turn in range(len(PARTS)):
            begun = time.process_time()
            if begun > min(self.until, over) or self._in_vain >= IN_VAIN:
                break
            starts = begins_elsewhere(fitter, found, self.noise, free, PARTS[turn], turn, over)
            if not len(starts):
                break
            sought = True
            if not turn:
                starts = np.vstack([begun_from, starts])
            ways = (fitter.from_forecasts, fitter.fit)
            near = found
            for start, way in itertools.product(starts, ways):
                if time.process_time() > over:
                    break
                found = min(found, way(near.model, start, near), key=lambda fit: fit.merit)
            self._left -= time.process_time() - begun
        if sought:
            self._in_vain = 0 if found.merit < GAINED * by_slopes else self._in_vain + 1
        return found


def begins_elsewhere(
    fitter: SmoothFitter, fit: Fit, noise: Array, free: int, parts: int = 1, seed: int = 0,
    over: float = np.inf,
) -> Array:  # fmt: skip
    """Numbers from which a fit may do better, (k, p), most promising first; none if there is no
    reason to look.

    They are several, since forecasts of a few windows do not tell the valleys of a law apart that
    a fit to all of them does.

    Args:
        fitter: Holds the windows.
        fit: The fit by slopes.
        noise: Noise of every measured channel, (m,).
        free: How many of its numbers, from the first on, are sought; the others stay.
        parts: That windows are foretold in.
        seed: Of the search.
        over: When the search ends with the generation it is at, on the clock of
            ``time.process_time``.
    """
    model = fit.model
    sticks = any(
        may_stick(candidate.effect, model.simulator, fitter.samples, fitter.nodes)
        for candidate in model.chosen
    )
    own_step = model.batched and not model.simulator.own_files()
    far = (fitter.over_noise(fit, noise) > FAR).any()
    if not (sticks and own_step and 0 < free <= MOST and far):
        return np.zeros((0, len(fit.theta)))
    forecasts = ShortForecasts(fitter, model, parts)
    space = _Space(model, fit.theta, free)
    low, high = space.low, space.high
    begin, about = space.point(fit.theta), ABOUT * (high - low)
    from scipy.stats import qmc  # a second to load, for few

    random = np.random.default_rng(seed)
    members = qmc.scale(qmc.LatinHypercube(free, rng=random).random(POPULATION * free), low, high)
    near = begin + about * random.standard_normal((len(members) // 2, free))
    members[: len(near)] = space.inside(near)
    result = differential_evolution(
        lambda points: forecasts.misses(space.numbers(points.T)),
        list(zip(low, high, strict=True)),
        vectorized=True, updating="deferred", polish=False, tol=0.0, rng=random,
        init=members, maxiter=GENERATIONS * free, x0=begin,
        callback=lambda *_, **__: time.process_time() > over,
    )  # fmt: skip
    ranked = result.population[np.argsort(result.population_energies)]
    return space.numbers(_apart(ranked, NEAR * (high - low)))


def _apart(points: Array, near: Array) -> Array:
    """The first of some points, (n, d), and up to ``STARTS`` in all that are not near another."""
    found = points[:1]
    for point in points[1:]:
        if len(found) < STARTS and (np.abs(found - point) > near).any(axis=1).all():
            found = np.vstack([found, point])
    return found


class _Space:
    """Where the first numbers of a set are sought: sizes by their logarithm, and what does nothing
    below another number by its ratio to that, since half of all pairs would be one law otherwise.

    Attributes:
        low, high: Least and greatest of every coordinate, (free,).
    """

    def __init__(self, model: Model, theta: Array, free: int) -> None:
        self.model, self.theta, self.free = model, theta, free
        knobs = model.knobs[:free]
        own = list(zip(model.owner[:free], (knob.field for knob in knobs), strict=True))
        above = {
            number: own.index((owner, knob.above))
            for number, (owner, knob) in enumerate(zip(model.owner, knobs, strict=False))
            if knob.above
        }
        self.ratios, self.bases = list(above), list(above.values())
        scale, low, high = 10 * model.step[:free], model.low[:free], model.high[:free]
        drives = [model.chosen[i].effect.drives for i in model.owner[:free]]
        begin, one_sided = theta[:free], np.isfinite(low) | np.array(drives, bool)
        self.log = low >= 0
        least = np.maximum(np.maximum(low, SMALLEST * scale), 1e-300)
        most = np.maximum(np.minimum(high, LARGEST * scale), least * (1 + 1e-6))
        down = np.where(one_sided, -LESS, -EITHER) * scale
        up = np.where(one_sided, MORE, EITHER) * scale
        down = np.maximum(np.minimum(down, begin), low)
        up = np.minimum(np.maximum(up, begin), high)
        self.low, self.high = (
            np.where(self.log, np.log(least), down),
            np.where(self.log, np.log(most), up),
        )
        self.low[self.ratios], self.high[self.ratios] = 0.0, np.log(ABOVE)

    def inside(self, points: Array) -> Array:
        """Points moved into the space; a bound itself may be outside by rounding."""
        margin = 1e-6 * (self.high - self.low)
        return np.clip(points, self.low + margin, self.high - margin)

    def numbers(self, points: Array) -> Array:
        """(V, free) in the space -> (V, p), the other numbers as they are."""
        found = np.repeat(self.theta[None], len(points), axis=0)
        own = np.where(self.log, np.exp(np.where(self.log, points, 0.0)), points)
        own[:, self.ratios] *= own[:, self.bases]
        found[:, : self.free] = own
        return np.clip(found, self.model.low, self.model.high)

    def point(self, theta: Array) -> Array:
        """(p,) -> (free,) in the space."""
        own = theta[: self.free]
        found = np.where(self.log, np.log(np.maximum(own, 1e-300)), own)
        found[self.ratios] -= found[self.bases]
        return self.inside(found)
