"""Whether a push that grows steadily along the records does the work of effects.

A room warms, a battery sags, the zero of a sensor wanders. No effect of the library depends on
time, so that what does is taken for others, each a little: a gain and a parameter that are a few
percent off, a store so slow that it never fills.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from residual.gap.fitting.contract import Fit
from residual.gap.fitting.screening import beside_starts
from residual.gap.fitting.shooting import capped
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.model.candidates import candidates
from residual.gap.search.sets import Key, Search
from residual.gap.search.significance import score, size
from sims.effects.joint import ConstantLoad

Array = NDArray[np.float64]

#: Blocks of data below which nothing is said: what lasts for a moment is no drift.
FEW = 6
#: Rounds of weighing windows by what is left of them.
TURNS = 8


class Drift:
    """How well sets do with a push that grows in proportion to time, in the linear picture."""

    def __init__(self, search: Search) -> None:
        self.search = search
        self.price = float(np.log(size(search)))
        self._scores: dict[Key, list[tuple[float, float]]] = {}

    def does_as_well(self, key: Key, number: int) -> bool:
        """Whether some members of a set but not this one, and a push that drifts, fit as well,
        though with a constant one they do not.

        What strikes the ground is not asked.

        Args:
            key: A fitted set.
            number: Its member.
        """
        search = self.search
        if not isinstance(search.fitter, SmoothFitter) or len(search.fitter.blocks) < FEW:
            return False
        rest = [i for i in key if i != number]
        subsets = itertools.chain.from_iterable(
            itertools.combinations(rest, count) for count in range(len(rest) + 1)
        )
        own = score(search, key)
        return any(
            drifting <= own < constant - self.price
            for k in subsets
            if k in search.tried
            for constant, drifting in self._with_push(k)
        )

    def _with_push(self, key: Key) -> list[tuple[float, float]]:
        """Scores of a set with a constant push on each joint, and with one that grows, too."""
        if key not in self._scores:
            search, fitter = self.search, self.search.fitter
            assert isinstance(fitter, SmoothFitter)
            fit, along = search.tried[key], _along_records(search)
            price = self.price * search.numbers(key)
            self._scores[key] = []
            for joint in search.simulator.joints:
                load = candidates(search.simulator, [ConstantLoad(joint.name)], fitter.samples)
                pushes = [beside_starts(fit, fitter.columns(fit, load, s)) for s in (None, along)]
                losses = [
                    _least_loss(fit, np.concatenate([fit.by_knob, *some], axis=2), fitter.cap)
                    for some in (pushes[:1], pushes)
                ]
                own = (losses[0] + price + self.price, losses[1] + price + 2 * self.price)
                self._scores[key].append(own)
        return self._scores[key]


def _least_loss(fit: Fit, columns: Array, cap: float) -> float:
    """Loss that columns (W, R, c) leave of a fit, in the linear picture; what weighed little before
    them may count in full beside them, so weights follow."""
    weights, least = fit.weights, fit.merit
    rows = columns.reshape(-1, columns.shape[2])
    size = np.sqrt(np.maximum((rows**2).sum(axis=0), 1e-300))
    rows = rows / size
    for _ in range(TURNS):
        root = np.repeat(np.sqrt(weights), columns.shape[1])
        step = np.linalg.lstsq(rows * root[:, None], fit.projected.ravel() * root, rcond=1e-9)[0]
        left = fit.projected - (rows @ step).reshape(fit.projected.shape)
        costs = (left**2).sum(axis=1)
        weights = np.minimum(1.0, cap / np.maximum(costs, 1e-300))
        least = min(least, float(capped(costs, cap).sum()))
    return least


def _along_records(search: Search) -> Array:
    """Where every sample lies in its record, from -1/2 to 1/2, (n,)."""
    samples = search.fitter.samples
    along = np.zeros(len(samples))
    for start, stop in samples.runs:
        times = samples.times[start:stop]
        along[start:stop] = (times - times[0]) / max(float(np.ptp(times)), 1e-300) - 0.5
    return along
