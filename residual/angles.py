"""Angles that were wrapped, made to go on over whole turns."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sims.simulator import Channel, wrap

Array = NDArray[np.float64]

#: Movement between rows in rad, by its rate, from which a wrapped angle may have gone further than
#: half a turn, noise and acceleration included.
FAR = 0.5 * np.pi
#: Range in rad, noise allowed for, beyond which an angle was not cut at a turn, and between which
#: quantiles: a few wild readings say nothing.
ONE_TURN, MOST = 1.05 * 2 * np.pi, (0.01, 0.99)
#: Distance in rad between an angle's movement and that by its rate, in nine rows of ten, up to
#: which the rate belongs to it: of one in another unit it is up to pi.
AGREES = 1.0


def unwrapped(values: Array, times: Array, rates: Array | None = None) -> Array:
    """An angle in rad that goes on over whole turns.

    Between rows it is taken to go the shorter way round, or, where its rate says that it moves by
    more than a quarter of a turn, to where the mean of both rows' rates leads. A rate that does not
    agree with the angle, as one in another unit, is left alone. What goes beyond one turn already
    was not cut: it jumps where samples are missing or stand still, and stays as it is.

    Args:
        values: The angle, shape (n,); NaN where it was not measured.
        times: Of the rows in s, shape (n,).
        rates: Of the angle in rad/s, shape (n,), if there is one; NaN where it was not measured.
    """
    found = values.copy()
    known = np.isfinite(values)
    angle, went = values[known], np.diff(values[known])
    if known.any() and np.ptp(np.quantile(angle, MOST)) > ONE_TURN:
        return found
    found[known] = np.unwrap(angle)
    if rates is None or not len(went):
        return found
    padded = np.pad(rates[known], 1, mode="edge")
    # Of three neighbours the middle one: a single wild reading leads nowhere.
    rate = np.sort(np.stack([padded[:-2], padded[1:-1], padded[2:]]), axis=0)[1]
    ahead = 0.5 * (rate[1:] + rate[:-1]) * np.diff(times[known])
    far = np.abs(ahead) > FAR
    off = wrap(went - ahead)
    if far.any() and np.nanquantile(np.abs(off), 0.9) <= AGREES:
        moved = np.where(far, ahead + off, wrap(went))
        turns = np.round((moved - went) / (2 * np.pi))
        found[known] = angle + 2 * np.pi * np.concatenate([[0.0], np.cumsum(turns)])
    return found


def with_whole_turns(states: Array, times: Array, channels: Sequence[Channel]) -> Array:
    """States whose angles go on over whole turns, see ``unwrapped``.

    Args:
        states: One column for each channel, (n, n_s); NaN where nothing was measured.
        times: Of the rows in s, (n,).
        channels: Which of them are angles, and which are the rates of those.
    """
    rate_of = {c.rate_of: states[:, i] for i, c in enumerate(channels) if c.kind == "rate"}
    found = states.copy()
    for column, channel in enumerate(channels):
        if channel.angle:
            found[:, column] = unwrapped(states[:, column], times, rate_of.get(channel.name))
    return found
