"""Names for data that a set of effects explains down to the noise.

Only there does significance name anything. While a remainder is left, every trifle is significant,
and ``residual.gap.search.choice`` decides by shares of the error instead.
"""

from __future__ import annotations

import numpy as np

from residual.gap.search.exchange import add_without_each
from residual.gap.search.known import departures
from residual.gap.search.pool import Key, all_but
from residual.gap.search.sets import Search

#: Difference of costs that says nothing.
NO_DIFFERENCE = 1.0
#: Forecast error with an effect over that without, below which it forecasts better.
BETTER = 0.95
#: Forecast error of a set over that of one that fits as well, from which on that one comes first:
#: a level that no fold but one tells fits all data, and foretells little.
ASTRAY = 1.5


def size(search: Search) -> int:
    """Number of residuals."""
    samples, windows = search.fitter.samples, search.fitter.blocks.windows
    rows = windows.index[windows.inside]
    return int(np.isfinite(samples.seen[rows][:, samples.measured]).sum())


def score(search: Search, key: Key) -> float:
    """Cost and a price for each number (the Bayesian information criterion); lower is better."""
    return search.tried[key].merit + np.log(size(search)) * search.numbers(key)


def price(search: Search, loss: float) -> float:
    """What a further number costs beside a loss, as the information criterion has it where the
    noise is not known: what is left counts one."""
    rows = size(search)
    return float(np.log(rows)) * max(1.0, loss / rows)


def significant(search: Search, needed: float) -> Key:
    """The set of least score, of which every effect lowers the cost by what chance does not.

    Costs of what strikes the ground hang on luck in finding start states, so there the best
    forecasts decide among such sets that fit as well; elsewhere much better ones do. A set that
    forecasts worse than the nominal simulator is none, however well it fits: noise that is not
    white passes for an effect.

    Args:
        search: Fitted sets, residuals in units of the noise.
        needed: Fall of the cost that earns a name.
    """
    key = _likeliest(search, needed)
    return key if search.error(key) <= search.error(()) else ()


def _likeliest(search: Search, needed: float) -> Key:
    key = pruned(search, min(search.usable(), key=lambda k: score(search, k)), needed)
    if not key:
        return key
    touches = search.simulator.has_contacts
    key = key if touches else least_otherwise(search, key)
    own = score(search, key)
    alike = [k for k in search.usable() if score(search, k) <= own + tie(search, key, k)]
    other = min((k for k in alike if search.numbers(k) <= search.numbers(key)), key=search.error)
    better = touches or search.error(key) > ASTRAY * search.error(other)
    return other if better and pruned(search, other, needed) == other else key


def tie(search: Search, key: Key, other: Key) -> float:
    """Difference of the scores of two sets that does not tell which is the right one."""
    fitter, tried = search.fitter, search.tried
    return max(fitter.tie(tried[()]), fitter.chance(tried[key], tried[other]))


def least_otherwise(search: Search, key: Key) -> Key:
    """Of sets that no data tell from one, as where effects move alike in an exact proportion, the
    one of the least surprising sizes, and with the least to be otherwise than was known."""
    merit, numbers = search.tried[key].merit, search.numbers(key)
    alike = [
        k
        for k in search.usable()
        if search.numbers(k) == numbers and search.tried[k].merit <= merit + NO_DIFFERENCE
    ]
    return min([key, *alike], key=lambda k: (search.surprises(k), departures(search, k)))


def pruned(search: Search, key: Key, needed: float) -> Key:
    """What is left of a set when all has gone that chance could do.

    What stands in place of more has to be one that may be right itself.
    """
    while key:
        add_without_each(search, key)
        smaller = [k for k in (all_but(key, gone) for gone in key) if search.sound(k)]
        falls = {
            k: search.tried[k].merit - search.tried[key].merit
            - np.log(size(search)) * (search.numbers(key) - search.numbers(k) - 1)
            for k in smaller if k in search.tried
        }  # fmt: skip
        if not falls:
            break
        if search.simulator.has_contacts:
            # Luck foretells nothing.
            falls = {
                k: fall if search.error(key) < BETTER * search.error(k) else -np.inf
                for k, fall in falls.items()
            }
        weakest = min(falls, key=lambda k: falls[k])
        if falls[weakest] > needed:
            break
        key = min((k for k in search.usable() if len(k) < len(key)), key=lambda k: score(search, k))
    return key
