"""What follows measured states and was not measured: stores, and parts on springs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.samples import Samples
from sims.effects.flexible import FlexiblePart

Array = NDArray[np.float64]


def filled(samples: Samples, state: Array, time: float) -> Array:
    """What a store holds that follows a state (n,), in every run first in balance with it."""
    from scipy.signal import lfilter  # a second to load, for few

    found = np.empty_like(state)
    for start, stop in samples.runs:
        away = state[start:stop] - state[start]
        kept = np.exp(-_step(samples, start, stop) / time)
        found[start:stop] = state[start] + lfilter([0.0, 1.0 - kept], [1.0, -kept], away)
    return found


def swung(samples: Samples, rate: Array, pulled: Array, part: FlexiblePart, without: bool) -> Array:
    """Place r beside its joint, and its rate, of a part that a joint's rate (n,) sets swinging.

    In every run it first hangs at rest. By the equations of ``FlexiblePart`` r'' = g - s - q''
    along the motion of a joint that has the part; along a motion without it, where q'' is ``a``,
    the joint would give way: r'' = (1 + ratio) (g - q'' - s).

    Args:
        samples: Give times and runs.
        rate: q' of the joint, (n,).
        pulled: The acceleration g of the part by forces of position, (n,).
        part: With its numbers.
        without: Whether the motion is one without the part.

    Returns:
        shape (n, 2).
    """
    from scipy.signal import cont2discrete, lfilter

    swing, gives = 2 * np.pi * float(part.frequency), 1.0 + float(part.ratio)
    held, driven = (1.0, gives) if without else (1.0 / gives, 1.0)
    below = [1.0, 2 * held * float(part.damping) * swing, held * swing**2]
    by_rate, by_pull = ([-1.0, 0.0], [-1.0, 0.0, 0.0]), ([1.0], [1.0, 0.0])
    found = np.zeros((len(rate), 2))
    for start, stop in samples.runs:
        found[start:stop, 0] = driven * pulled[start] / below[2]
        step = _step(samples, start, stop)
        if not step:
            continue
        for moves, transfers in ((rate, by_rate), (pulled, by_pull)):
            away = driven * (moves[start:stop] - moves[start])
            for column, above in enumerate(transfers):
                # What drives it runs straight from sample to sample.
                numerator, denominator, _ = cont2discrete((above, below), step, method="foh")
                found[start:stop, column] += lfilter(np.ravel(numerator), denominator, away)
    return found


def _step(samples: Samples, start: int, stop: int) -> float:
    """Usual time from sample to sample of a run in s; 0 of a single sample."""
    return float(np.median(np.diff(samples.times[start:stop]))) if stop - start > 1 else 0.0
