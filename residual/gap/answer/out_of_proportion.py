"""A parameter that is out of all proportion, and alone does as much as what was named."""

from __future__ import annotations

import numpy as np

from residual.gap.answer.confirmed import Answer
from residual.gap.fitting.plausible import ratios, stands_still
from residual.gap.search.comparisons import takes_off
from residual.gap.search.pool import Key

#: Error over that of what was named up to which a single number does as much.
AS_MUCH = 1.1
#: Largest factor between a parameter and its nominal value that a slip in a unit makes.
FARTHEST = 1000.0


def out_of_proportion(answer: Answer) -> list[str]:
    """A sentence on the parameter that would do as much alone at a value that nobody believes; none
    if there is none, or something was named for certain.

    A time constant at a twentieth of its value is refused, for what is missing elsewhere may look
    so. It may also be a slip in the simulator, in place of which two effects were put together.

    Args:
        answer: What was found.
    """
    search, key = answer.found.search, answer.key
    if any(claim.sure for claim in answer.claims):
        return []
    before = search.before.squares
    most = AS_MUCH * search.error(key) if key else 1.0

    def does_as_much(one: Key) -> bool:
        return (
            len(one) == 1
            and search.candidates[one[0]].effect.enters == "parameter"
            and one in search.validated
            and search.numbers(one) <= max(search.numbers(key), 1)
            and search.error(one) <= most
            and takes_off(search.currency, before, search.validated[one].squares)
        )

    found = [one for one in search.refused if does_as_much(one)]
    for one in sorted(found, key=search.error):
        fit = search.tried[one]
        told = ratios(fit.model.bind(fit.theta), fit.model.added(fit.theta))
        ratio = next(iter(told.values()), 0.0)
        if not 1 / FARTHEST <= ratio <= FARTHEST or stands_still(fit, search.fitter):
            continue  # it only switches something off
        after = search.validated[one].squares
        taken = search.currency.share(before, after, np.random.default_rng(0))[0]
        name = search.candidates[one[0]].label.replace("_", " ")
        beside = ", as much as what is named" if key else ""
        return [
            f"{name} at {ratio:.2g} times its nominal value would take {taken:.0%} of the gap alone"
            f"{beside}: see whether the simulator has it right"
        ]
    return []
