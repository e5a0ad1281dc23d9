"""Whether one set of effects forecasts as well as another, or materially better."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from residual.gap.search.currency import Currency
from residual.gap.search.pool import Key
from residual.gap.search.sets import Search

Array = NDArray[np.float64]

#: Part of the remaining error that an effect must take off: over all joints, or at one of them.
MATERIAL, AT_ONE = 0.2, 0.3
#: And of the nominal error.
TRIFLE = 0.005
#: Loss over that of another set from which on a fit is no match.
NO_MATCH = 9.0
#: Differences of relative errors below this are none, nor such below a part of the best error.
SAME, ALIKE = 0.01, 0.1


def as_good(search: Search, key: Key, best: Key) -> bool:
    """Whether a set forecasts as well as the best at every joint: within chance, or next to it."""
    currency = search.currency
    own, its = (search.validated[k].squares for k in (key, best))
    behind = currency.by_group(own) - currency.by_group(its)
    slack = np.minimum(SAME, ALIKE * currency.by_group(its))
    return all(
        behind[group] <= slack[group] or currency.clearly(own, its, group) <= 1.0
        for group in range(len(behind))
    )


def material(search: Search, smaller: Key, larger: Key) -> bool:
    """Whether a set takes a fifth off what a smaller one leaves, or three tenths at one joint."""
    squares = search.validated
    return takes_off(search.currency, squares[smaller].squares, squares[larger].squares)


def takes_off(currency: Currency, worse: Array, better: Array) -> bool:
    """The same of mean squared errors of blocks, each (B, m)."""
    before, after = currency.by_group(worse), currency.by_group(better)
    gained = before - after
    in_all = currency.averaged(gained)
    if in_all <= 0:
        return False
    over_all = in_all > max(MATERIAL * currency.averaged(before), TRIFLE)
    return bool(over_all or ((gained > AT_ONE * before) & (gained > TRIFLE)).any())


def helps(search: Search, smaller: Key, larger: Key) -> bool:
    """Whether a set forecasts better than a smaller one beyond a standard error."""
    squares = search.validated
    gained, error = search.currency.difference(squares[smaller].squares, squares[larger].squares)
    return gained > error


def no_match(search: Search, key: Key, other: Key) -> bool:
    """Whether a set leaves so much more of the data than another that it is out."""
    return search.tried[key].merit > NO_MATCH * search.tried[other].merit
