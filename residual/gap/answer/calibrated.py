"""Parameters that were moved within their tolerance so that the rest can be seen."""

from __future__ import annotations

import numpy as np

from residual.gap.result import Number, Span, Verdict
from residual.gap.search.pool import Key
from residual.gap.search.sets import Search

#: Part of what a parameter may change by that is a change: with 3 % either way, 0.1 % of its value.
MOVED = 0.02


def moved(search: Search, key: Key) -> dict[str, Number]:
    """Parameters that are free beside every set and not where they were, by their own names.

    Their intervals are all that was allowed.
    """
    fit, first = search.tried[key], search.numbers(key)
    found = {}
    for one, value, knob in zip(
        search.beside, fit.theta[first:], fit.model.knobs[first:], strict=True
    ):
        if abs(value) > MOVED * (knob.high - knob.low):
            found[str(one.effect)] = Number(float(value), knob.low, knob.high, knob.unit)
    return found


def calibrated_verdict(search: Search, numbers: dict[str, Number]) -> Verdict:
    """What moved, and what that takes off alone.

    Args:
        search: With these parameters free.
        numbers: See ``moved``.
    """
    taken = search.currency.share(
        search.before.squares, search.validated[()].squares, np.random.default_rng(0)
    )
    changes = ", ".join(f"{name} {n.value:+.3g} {n.unit}" for name, n in numbers.items())
    return Verdict(
        "calibrated", "", "", numbers, (), "",
        f"parameters moved within their tolerance, so that the rest can be seen: {changes}",
        Span(*taken),
    )  # fmt: skip
