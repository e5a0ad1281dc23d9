"""What few windows leave open, asked on more of them.

Windows of systems that strike the ground are fitted one by one, each by a simulation for every
state. So few of them are searched, and only sets that those do not tell apart meet on more.
"""

from __future__ import annotations

import dataclasses
import functools
import time
from collections.abc import Callable

from residual.gap.fitting.contract import Fitter
from residual.gap.preparation.prepare import Prepared
from residual.gap.search.choice import Choice
from residual.gap.search.explain import Explanation
from residual.gap.search.pool import Key
from residual.gap.search.reasons import reasons
from residual.gap.search.sets import Search
from residual.gap.search.significance import ASTRAY, score, significant, tie

#: Sets that meet, the chosen one among them.
FINALISTS = 3


def finalists(found: Explanation) -> list[Key]:
    """The chosen set, and those of as few numbers that fit as well within chance and do not
    forecast far worse, the ones that forecast best first."""
    search, key = found.search, found.key
    own = score(search, key)
    near = [
        other
        for other in search.usable()
        if other not in ((), key)
        and search.numbers(other) <= search.numbers(key)
        and score(search, other) - own <= tie(search, key, other)
        and search.error(other) <= ASTRAY * search.error(key)
    ]
    return [key, *sorted(near, key=search.error)[: FINALISTS - 1]]


def on_more_windows(
    prepared: Prepared, found: Explanation, until: float, tell: Callable[[str], None]
) -> tuple[Prepared, Explanation, list[str]]:
    """The choice among the finalists on more windows, if there are several and more windows.

    Args:
        prepared: The windows that were searched, and what makes more of them.
        found: What was chosen there.
        until: When to leave it at that, on the clock of ``time.process_time``.
        tell: Progress.

    Returns:
        The windows that decided, what they chose, and what is to be said of it.
    """
    sets = len(finalists(found)) if prepared.more and found.key else 0
    if prepared.more is None or sets < 2:
        return prepared, found, []
    few, tried = len(found.search.fitter.blocks.windows), len(found.search.tried)
    if time.process_time() > until:
        says = f"{sets} sets of effects are as good on the {few} windows that were searched"
        return prepared, found, [f"{says}; there was no time to ask more: give more --minutes"]
    tell(f"the {sets} sets that {few} windows leave open, on more of them")
    fitter = prepared.more()
    says = (
        f"{tried} sets of effects were compared on {few} windows of the log, and the {sets} that "
        f"those leave open on {len(fitter.blocks.windows)}"
    )
    fresh = dataclasses.replace(prepared, fitter=fitter, more=None)
    return fresh, decided(found, fitter), [says]


def decided(found: Explanation, fitter: Fitter) -> Explanation:
    """The finalists, fitted to more windows, and the choice among them.

    Args:
        found: The choice on few windows, with what was tried there.
        fitter: More windows; channels are weighed as they were.
    """
    earlier = found.search
    fitter = fitter.weighed_like(earlier.fitter)
    search = Search(
        earlier.simulator, earlier.candidates[: earlier.screened], fitter, earlier.effort,
        earlier.tell, earlier.until, earlier.beside, earlier.twins, found.floor.sigma,
    )  # fmt: skip
    sets = finalists(found)
    shared = tuple(sorted(set.intersection(*map(set, sets))))
    # What all of them hold first: they are fitted from there.
    first = [shared] if shared in earlier.tried and shared else []
    search.add({key: earlier.own(key) for key in dict.fromkeys([*first, *sets])})
    needed = fitter.needed(functools.partial(search.signatures, ()), search.tried[()])
    key = significant(search, needed)
    left, nominal_left = (
        fitter.left(fit, found.floor) for fit in (search.tried[key], search.nominal)
    )
    return Explanation(
        search, Choice(key, reasons(search, key)), left, nominal_left, found.floor, needed
    )
