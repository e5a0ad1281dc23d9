"""Whether a wholly different answer does as well as one in which an effect seems certain."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Sequence

from residual.gap.confirmation.claim import Claim
from residual.gap.confirmation.rivals import excluded
from residual.gap.fitting.noise import Noise
from residual.gap.search.pool import Key
from residual.gap.search.sets import Search
from residual.gap.search.without import add_answers_without, answers_without

#: Seconds of processor time for all such questions together, within the budget: of 190 answers one
#: changed for them, and that took two.
SECONDS = 20.0


def with_other_answers(
    search: Search, key: Key, claims: Sequence[Claim], adequate: bool, floor: Noise, until: float
) -> tuple[Claim, ...]:
    """The claims of a set of several, with what does as well without those that seem certain.

    One effect alone has met all others, and pairs of them, when it was chosen.

    Args:
        search: With the set; what is tried goes there.
        key: The set.
        claims: Of its members.
        adequate: Whether it leaves no more than noise, so that chance alone decides.
        floor: Noise around it.
        until: When to ask no further, on the clock of ``time.process_time``.
    """
    asked = [claim for claim in claims if claim.sure] if len(key) > 1 else []
    end = min(until, time.process_time() + SECONDS)

    def quiet(other: Key) -> bool:
        return search.fitter.left(search.tried[other], floor).adequate

    told = {}
    for turn, claim in enumerate(asked):
        now = time.process_time()
        each = (end - now) / (len(asked) - turn)
        if each > 0:
            add_answers_without(search, key, claim.number, quiet, now + each)
        for other in answers_without(search, key, claim.number):
            if not excluded(search, key, other, claim.number, adequate, alike=False):
                instead = tuple(dict.fromkeys(search.labels(other)))
                told[claim.number] = dataclasses.replace(claim, instead=instead)
                break
    return tuple(told.get(claim.number, claim) for claim in claims)
