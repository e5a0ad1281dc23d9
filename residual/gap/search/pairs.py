"""Every two of few effects, fitted in full."""

from __future__ import annotations

from residual.gap.fitting.screening import pair_gains
from residual.gap.search.beam import extend, improves
from residual.gap.search.exchange import from_screen
from residual.gap.search.pool import Key
from residual.gap.search.redundant import by_points
from residual.gap.search.sets import Search
from residual.gap.search.sound import sound

#: Candidates up to which every two of them are fitted.
FEW = 12


def every_two(search: Search) -> None:
    """Fit every two effects where there are few, those first that gain most in the linear picture.

    Where the nominal simulator is far off, that picture tells little: beside a lag of twenty
    samples, a gain helps only once the lag is nearly as long.
    """
    points = by_points(search)
    if search.screened - len(points) > FEW:
        return
    around, reached = search.signatures(()), search.error(search.best())
    found: list[Key] = []
    for gain in pair_gains(around, len(around.variants) ** 2, without=points):
        fresh, theta = from_screen(search, (), gain)
        if search.late:
            break
        if fresh not in search.tried and search.fits_in(fresh):
            found += sound(search, fresh, theta)
    best = min(found, key=search.error, default=())
    if improves(search, best, reached):
        extend(search, best)
