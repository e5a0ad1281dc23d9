"""Rivals that the few windows of the search leave open, against the chosen set on all windows."""

from __future__ import annotations

from collections.abc import Collection

from residual.gap.contact.refine import Refined, level, renew
from residual.gap.contact.search import Key, Search, exchanged
from residual.gap.contact.shots import Shots
from residual.gap.contact.student import trimmed_drop

#: At most so many rivals are fitted to all windows, the best on the few first.
MOST = 2


def excluded(search: Search, rival: Key, key: Key, beaten: Collection[Key] = ()) -> bool:
    """Whether a set leaves materially more than the chosen one, or has been beaten by it."""
    return rival in beaten or search.drop(rival, key) > search.rules.material


def duels(search: Search, key: Key, full: Refined, whole: Shots, steps: int) -> frozenset[Key]:
    """Rivals with one effect exchanged that leave materially more than the chosen set.

    Args:
        search: With all that was tried.
        key: The chosen set.
        full: Its fit to all windows.
        whole: All windows.
        steps: Full steps of a rival's fit, as many as the chosen set has had.
    """
    rivals = [
        rival
        for rival in search.tried
        if exchanged(key, rival) and not excluded(search, rival, key)
    ]
    beaten = set()
    for rival in sorted(rivals, key=lambda rival: search.tried[rival].total)[:MOST]:
        near = search.tried[rival]
        fitted = renew(near.model, near.theta, whole, whole.guess, steps)
        chosen, other = level(full, fitted, whole)
        drop = trimmed_drop(other.loss, chosen.loss)
        more = f"{100 * abs(drop):.1f} % {'more' if drop > 0 else 'less'}"
        search.tell(f"  on all windows {search.named(rival)} leaves {more}")
        if drop > search.rules.material:
            beaten.add(rival)
    return frozenset(beaten)
