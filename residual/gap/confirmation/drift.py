"""Whether a push that grows steadily along each record does the work of effects.

A room warms, a battery sags, the zero of a sensor wanders. No effect of the library depends on
time, so that what does is taken for others, each a little: a gain and a parameter that are a few
percent off, a store so slow that it never fills.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from residual.gap.confirmation.constancy import FEW, along_records
from residual.gap.confirmation.push import pushed
from residual.gap.fitting.contract import Fit
from residual.gap.fitting.linearised import capped
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.search.pool import Key
from residual.gap.search.sets import Search
from residual.gap.search.significance import price

Array = NDArray[np.float64]

#: Part of what is left beside a constant push that one which drifts may leave, from which on sizes
#: have to hold beside it, too.
MUCH = 0.5
#: Records of which it is no chance that a push grows alike in all.
ALIKE = 3
#: Part of the largest eigenvalue from which on slopes by differences tell two directions apart: an
#: input that rises along a record as time does is none that a drift could be told from.
RESOLVED = 1e-8
#: Rounds of weighing windows by what is left of them.
TURNS = 8


class Fall(NamedTuple):
    """What a set leaves beside further columns, the numbers of these, and its own there, (p,)."""

    loss: float
    numbers: Array
    theta: Array


class Drift:
    """How well sets do with a push that grows in proportion to time, in the linear picture."""

    def __init__(self, search: Search) -> None:
        self.search = search
        self._losses: dict[Key, list[tuple[Fall, Fall]]] = {}

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
        own, numbers = search.tried[key].merit, search.numbers(key)
        each = price(search, own)

        def behind(k: Key, fall: Fall) -> float:
            return fall.loss - own + each * (search.numbers(k) + len(fall.numbers) - numbers)

        return any(
            behind(k, drifting) <= 0.0 < behind(k, constant) - each
            for k in subsets
            if k in search.tried
            for constant, drifting in self._with_push(k)
        )

    def sizes(self, key: Key) -> list[Array]:
        """The numbers of a set beside pushes that drift, (p,) each, where these take much off.

        What grows along a record moves sizes, too, that nothing else would replace.
        """
        search = self.search
        if not isinstance(search.fitter, SmoothFitter) or len(search.fitter.blocks) < FEW:
            return []
        return [
            drifting.theta
            for constant, drifting in self._with_push(key)
            if drifting.loss < MUCH * constant.loss
        ]

    def least(self, key: Key) -> float:
        """What a set leaves beside a push that drifts on the joint where that takes off most."""
        return min((drifting.loss for _, drifting in self._with_push(key)), default=math.inf)

    def _with_push(self, key: Key) -> list[tuple[Fall, Fall]]:
        """What a set leaves beside a constant push on each joint, and beside one that grows in each
        record in its own way, too."""
        if key not in self._losses:
            search, fitter = self.search, self.search.fitter
            assert isinstance(fitter, SmoothFitter)
            fit, along = search.tried[key], along_records(search)
            of_record = _records(fitter.blocks.windows.run)
            self._losses[key] = []
            for joint in search.simulator.joints:
                pushes = [pushed(fitter, fit, joint.name, share) for share in (None, along)]
                pushes[1] = pushes[1] * of_record
                constant, drifting = (
                    beside(fit, some, fitter.cap) for some in (pushes[:1], pushes)
                )
                self._losses[key].append((constant, drifting))
        return self._losses[key]


def beside(fit: Fit, more: Sequence[Array], cap: float) -> Fall:
    """A fit beside further columns (W, R, c), in the linear picture; what weighed little without
    them may count in full beside them, so weights follow."""
    columns = np.concatenate([fit.by_knob, *more], axis=2)
    size = np.sqrt(np.maximum((columns**2).sum(axis=(0, 1)), 1e-300))
    columns = columns / size
    grams = columns.transpose(0, 2, 1) @ columns
    rights = np.einsum("wrc,wr->wc", columns, fit.projected)
    costs = (fit.projected**2).sum(axis=1)
    weights, least, best = fit.weights, fit.merit, np.zeros(columns.shape[2])
    for _ in range(TURNS):
        matrix = np.einsum("wij,w->ij", grams, weights)
        step = np.linalg.pinv(matrix, rcond=RESOLVED) @ (weights @ rights)
        left = np.maximum(costs - 2 * rights @ step + grams @ step @ step, 0.0)
        weights = np.minimum(1.0, cap / np.maximum(left, 1e-300))
        loss = float(capped(left, cap).sum())
        if loss < least:
            least, best = loss, step / size
    own = fit.by_knob.shape[2]
    return Fall(least, best[own:], fit.theta + best[:own])


def _records(run: NDArray[np.int64]) -> Array:
    """How much each of some courses has to do with every window, (W, 1, r): one for each record; of
    three and more what differs between them, since what is the same in all hangs on the motion,
    and not on time."""
    own = (run[:, None] == np.unique(run)).astype(float)
    count = own.shape[1]
    if count >= ALIKE:
        own = own[:, :-1] - own[:, -1:]
    return own[:, None, :]
