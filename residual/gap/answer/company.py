"""Effects that help only beside others that may not be there.

A slope and a constant together come near to any bent law: each is needed beside the other, and
neither helps alone. Where the constant may be zero, the slope is no more certain than that.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from residual.gap.confirmation.claim import Claim
from residual.gap.result import Doubt, Verdict
from residual.gap.search.pool import Key, all_but
from residual.gap.search.sets import Search

#: Doubts whether an effect is there at all.
MAY_BE_NONE: frozenset[Doubt] = frozenset({"not_needed", "may_be_zero", "share_may_be_zero"})


def in_company(
    search: Search, key: Key, claims: Sequence[Claim], verdicts: Sequence[Verdict]
) -> list[Claim]:
    """The claims, with what is known of those that are certain beside others that may not be there.

    Args:
        search: What is tried goes there.
        key: The set of the effects.
        claims: Of its members, ``verdicts``: on them.
    """
    told = list(zip(claims, verdicts, strict=True))
    maybe = [claim.number for claim, verdict in told if MAY_BE_NONE.intersection(verdict.doubts)]
    return [
        dataclasses.replace(
            claim,
            in_company=verdict.kind == "confirmed"
            and helps_only_beside(search, key, claim.number, maybe),
        )
        for claim, verdict in told
    ]


def helps_only_beside(search: Search, key: Key, number: int, others: Sequence[int]) -> bool:
    """Whether, without one of some other effects of a set, an effect makes forecasts no better.

    Args:
        search: What is tried goes there.
        key: The set.
        number: The effect.
        others: Those that may not be there.
    """
    return any(
        _error(search, all_but(key, other)) >= _error(search, all_but(all_but(key, other), number))
        for other in others
        if other != number
    )


def _error(search: Search, key: Key) -> float:
    """Error of a set, which is fitted if it was not."""
    if key not in search.tried:
        larger = min((k for k in search.tried if set(key) < set(k)), key=len)
        search.add({key: search.merged(larger, (), drop=tuple(set(larger) - set(key)))[1]})
    return search.error(key)
