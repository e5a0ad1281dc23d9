"""Fits from states that are known to the last digit, as those of a simulator that is the truth."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from residual.gap.fitting.impacts.noise import spread, with_noise
from residual.gap.fitting.impacts.refine import Refined, improved, settle
from residual.gap.fitting.impacts.single_shooting import WindowData

Array = NDArray[np.float64]

#: Steps of finite differences where states are known, as shares of usual ones, one after the other:
#: noise is what is left, so that it and the steps shrink together.
EVER_FINER = (0.3, 0.1, 0.03, 0.01, 0.004)
#: Share of the loss that two of them must take off for the next: what is right falls by far more,
#: and what is wrong stays.
FALLS = 0.1


def sharpened(best: Refined, data: WindowData, scale: Array, turns: int) -> Refined:
    """A fit from states that are known, gone on with in units of what it leaves, ever less.

    Most intervals are then explained to the last digit, and those with an impact count little.

    Args:
        best: The fit.
        data: The windows.
        scale: Usual size of every physical state, (n_p,).
        turns: At most so many steps in each unit.
    """
    before = np.inf
    for width in EVER_FINER if len(best.theta) else ():
        fine = with_noise(data, spread(data, best.fitted)[0], scale)
        found = settle(best.model, best.theta, fine, best.fitted.starts, 0)
        found = improved(found, fine, turns, width)
        again = settle(best.model, found.theta, data, best.fitted.starts, 0)
        reached, best = best.total, again if again.total < best.total else best
        if best.total > (1 - FALLS) * before:
            break
        before = reached
    return best
