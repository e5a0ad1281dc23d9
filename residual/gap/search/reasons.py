"""Why each set of effects was not chosen, in words."""

from __future__ import annotations

from residual.gap.search.comparisons import MATERIAL, SAME, as_good
from residual.gap.search.known import departures
from residual.gap.search.pool import Key
from residual.gap.search.sets import Search
from residual.gap.search.significance import score
from residual.trajectories import moment


def reasons(search: Search, chosen: Key) -> dict[Key, str]:
    """One reason for every set that was tried and not chosen."""
    found = {}
    own = search.error(chosen)
    for key in search.tried:
        if key == chosen:
            continue
        if key in search.unfit:
            found[key] = "did not converge"
        elif key in search.refused:
            found[key] = search.refused[key]
        elif search.error(key) > own + SAME:
            found[key] = _errs_more(search, key, chosen)
        elif set(chosen) < set(key):
            found[key] = _not_enough(search, key, chosen)
        elif search.numbers(key) >= search.numbers(chosen):
            found[key] = _no_fewer_numbers(search, key, chosen)
        elif departures(search, key) > departures(search, chosen):
            found[key] = "as good, but departs more from what was known beforehand"
        else:
            found[key] = _errs_more(search, key, chosen)
    return found


def _errs_more(search: Search, key: Key, chosen: Key) -> str:
    """How much more a set errs, and where most."""
    times = search.error(key) / max(search.error(chosen), 1e-12)
    return f"{times:.2g} times the error" + _worst(search, key, chosen)


def _no_fewer_numbers(search: Search, key: Key, chosen: Key) -> str:
    """Why a set of other effects and no fewer numbers does not take the place of the chosen one."""
    more = search.numbers(key) - search.numbers(chosen)
    if not more or search.error(key) > (1 - MATERIAL) * search.error(chosen):
        return "as good, with as many or more numbers"
    times = search.error(chosen) / max(search.error(key), 1e-12)
    numbers = f"{more} numbers more" if more > 1 else "a number more"
    return f"{times:.2g} times less error with {numbers}, which these blocks do not establish"


def _not_enough(search: Search, key: Key, chosen: Key) -> str:
    """Why what a set holds beyond the chosen one is not asked for."""
    taken = max(1 - search.error(key) / max(search.error(chosen), 1e-12), 0.0)
    more = len(key) - len(chosen)
    off = f"{100 * taken:.2g} % off what remains" + (f" with {more} effects more" * (more > 1))
    if taken < 1 - (1 - MATERIAL) ** more:
        return f"takes only {off}"
    if as_good(search, chosen, key):
        return f"takes {off}, no more than chance may"
    if score(search, chosen) <= score(search, key):
        return f"takes {off}, and fits no better"
    return f"takes {off}, but these data do not establish it"


def _worst(search: Search, key: Key, chosen: Key) -> str:
    """The block in which a set falls behind most."""
    currency, blocks = search.currency, search.fitter.blocks
    behind = currency.in_blocks(search.validated[key].squares)
    behind -= currency.in_blocks(search.validated[chosen].squares)
    number = int(behind.argmax())
    windows, samples = blocks.windows, search.fitter.samples
    first = int((blocks.block == number).argmax())
    start = samples.times[windows.index[first, 0]]
    return f", most at {moment(start)} of {samples.names[windows.run[first]]}"
