"""Numbers by the profile of the loss: seen at several sizes, with start states sought at each.

Of what strikes the ground a start state is found by luck, and a loss at one size with it. Along a
line of sizes, gone there and back, each window has the best start state of two; a parabola through
its losses says what it has to say of the size, luck included.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from residual.gap.fitting.impacts.refine import Refined, settle
from residual.gap.fitting.impacts.robust import weights
from residual.gap.fitting.impacts.single_shooting import WindowData
from residual.gap.fitting.impacts.start_states import begun, descend

Array = NDArray[np.float64]

#: Sizes on either side, as shares of a number, or of its usual step where that is more.
SHARES, STEP = (0.08, 0.16), 0.15
#: How far the first round reaches, in these, and every round after one within whose reach luck
#: hides the size, in that; how far one reaches at the most; most rounds.
WIDE, WIDEST, ROUNDS = 2.5, 6.25, 4
#: Part of what a round reaches within which the least value has to lie; how far losses count about
#: it, in such reaches.
WITHIN, ABOUT = 0.8, 1.5
#: Least curvature of all windows over that of the most curved one.
CURVED = 1e-6


def by_profile(
    found: Refined, data: WindowData, blocks: NDArray[np.int64]
) -> tuple[Refined, Array]:
    """A fit with numbers by the profile, and how well these are known, a standard deviation with
    Student's t in it, (p,): infinite where the loss has no least value near.

    Args:
        found: The fit.
        data: The windows.
        blocks: Which block each of them is in, (W,); one after the other is left out.
    """
    spread = np.zeros(len(found.theta))
    for number in range(len(found.theta)):
        way, origin = _along(found, number), found.theta
        line, lost = np.zeros(0), np.zeros((0, len(data)))
        wide = WIDE
        for _ in range(ROUNDS):
            reach = wide * SHARES[-1] * _unit(found, number)
            middle = found.theta[number] - origin[number]
            fits = there_and_back(found, data, number, wide * way)
            line = np.append(line, [fit.theta[number] - origin[number] for fit in fits])
            lost = np.concatenate([lost, [fit.loss for fit in fits]])
            near = np.abs(line - middle) <= ABOUT * reach
            least, spread[number] = lowest(line[near], lost[near], blocks)
            to = origin + way * np.clip(least, line.min(), line.max())
            to = np.clip(to, found.model.low, found.model.high)
            best = min(fits, key=lambda fit: abs(fit.theta[number] - to[number])).fitted
            fresh = settle(found.model, to, data, best.starts, 1, best.by_start)
            found = dataclasses.replace(fresh, slopes=found.slopes)
            told = spread[number] <= reach
            if told and wide == 1.0 and abs(least - middle) <= WITHIN * reach:
                break
            wide = 1.0 if told else min(WIDE * wide, WIDEST)
    return found, spread


def lowest(line: Array, lost: Array, blocks: NDArray[np.int64]) -> tuple[float, float]:
    """Where the loss is least on a line, (G,), and the standard deviation of that; the best place
    that was tried and infinity, if it has no least value.

    Args:
        line: Places.
        lost: Losses of every window there, (G, W).
        blocks: Which block each of them is in, (W,).
    """
    if len(np.unique(line)) < 3:  # it cannot go on past its bounds
        return float(line[lost.sum(axis=1).argmin()]), np.inf
    square, slope, _ = np.polyfit(line, lost, 2)
    of_block = [blocks == b for b in np.unique(blocks)]
    a, b = (
        np.array([coefficient[own].sum() for own in of_block]) for coefficient in (square, slope)
    )
    rest = a.sum() - a
    if min(a.sum(), rest.min()) <= CURVED * np.abs(a).max():
        return float(line[lost.sum(axis=1).argmin()]), np.inf
    count = len(of_block)
    without = -(b.sum() - b) / (2 * rest)
    variance = (count - 1) / count * ((without - without.mean()) ** 2).sum()
    times = stdtrit(max(count - 1, 1), 0.975) / 1.96
    return float(-b.sum() / (2 * a.sum())), float(np.sqrt(variance) * times)


def there_and_back(found: Refined, data: WindowData, number: int, way: Array) -> list[Refined]:
    """Fits of start states at several sizes of a number, the others following it (p,).

    The fit itself takes no part: it has sought for longer than any other.
    """
    model = found.model
    line = _unit(found, number) * np.array([*(-s for s in SHARES[::-1]), 0.0, *SHARES])
    thetas = np.clip(found.theta + line[:, None] * way, model.low, model.high)
    fits: dict[int, Refined] = {}
    near, places = found.fitted, range(len(line))
    for place in (*places, *reversed(places)):
        theta, known = thetas[place], fits.get(place)
        if known is None:
            fits[place] = settle(model, theta, data, near.starts, 1, near.by_start)
        else:  # on the way back, with the derivative of the way there
            begin = begun(model, theta, data, near.starts, known.fitted.by_start)
            back = Refined.of(model, theta, descend(model, theta, data, begin), data)
            fits[place] = back.with_better(known)
        near = fits[place].fitted
    return [fits[place] for place in places]


def _unit(found: Refined, number: int) -> float:
    """What shares of a number are shares of."""
    theta, step = found.theta[number], found.model.step[number]
    return float(max(abs(theta), STEP * step / SHARES[0]))


def _along(found: Refined, number: int) -> Array:
    """What all numbers change by with one of them, by what fits best if all is linear, (p,)."""
    way = np.eye(len(found.theta))[number]
    if found.slopes is None or len(way) < 2:
        return way
    weight = weights(found.costs_ahead, found.freedom)
    rows = found.slopes.ahead * np.sqrt(weight)[:, None, None]
    inverse = np.linalg.pinv(np.einsum("wri,wrj->ij", rows, rows), rcond=1e-10, hermitian=True)
    return inverse[number] / inverse[number, number] if inverse[number, number] > 0 else way
