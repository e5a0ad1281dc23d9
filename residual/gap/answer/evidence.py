"""What was tried, and why it was not chosen."""

from __future__ import annotations

from collections.abc import Sequence

from residual.gap.result import Rival
from residual.gap.search.comparisons import material
from residual.gap.search.explain import Explanation
from residual.gap.search.pool import Key
from residual.gap.search.reasons import reasons

#: Sets that are listed.
MOST = 40


def evidence(found: Explanation, left: Key, leads: Sequence[str]) -> tuple[Rival, ...]:
    """The set that is left first, then all others by error, each with a reason.

    Args:
        found: Search and choice.
        left: What is left of the choice, without what could not be named.
        leads: Labels of that.
    """
    search, why = found.search, found.choice.reasons
    if found.key != left:
        larger = {key for key in search.usable() if set(left) < set(key)}
        gone = {key for key in search.tried if set(search.labels(key)) & set(leads)}
        gone |= {key for key in larger if material(search, left, key)}
        unnamed = dict.fromkeys(gone, "holds effects that these data do not establish")
        why = reasons(search, left) | unnamed | search.refused
    rows = [
        Rival(
            search.labels(key), search.error(key), key == left,
            "" if key == left else why.get(key, "tried against the chosen ones"),
        )
        for key in search.tried
    ]  # fmt: skip
    return tuple(sorted(rows, key=lambda row: (not row.chosen, row.error))[:MOST])
