"""How hard to search."""

from __future__ import annotations

import dataclasses


@dataclasses.dataclass(frozen=True)
class Effort:
    """How hard to search.

    Args:
        singles: Effects of the screen that are fitted alone.
        pairs: Pairs of the screen that are fitted.
        triples: And those of three that help only together, at the most.
        beam: Sets that are grown further, beside the one that forecasts best.
        grown: Effects that each of these is grown by, one at a time.
        most: Largest number of effects in a set.
        stale: Share of the error that one more effect must take off for the search to go on.
        enough: Error over that of the nominal simulator below which nothing larger is tried.
        partners: Best single effects of which every two are fitted together.
        tried: Sets that are fitted before nothing new is tried, however much time is left.
        parameters: Whether each of the simulator's own parameters is fitted alone, whatever the
            screen says.
    """

    singles: int = 8
    pairs: int = 2
    triples: int = 6
    beam: int = 2
    grown: int = 4
    most: int = 8
    stale: float = 0.05
    enough: float = 0.0
    partners: int = 0
    tried: int = 100_000
    parameters: bool = False
