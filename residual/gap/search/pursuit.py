"""Sets of effects by orthogonal matching pursuit, around the measured path.

Where several effects make a large gap, none of them takes much off forecasts alone. Along the
measured path what each of them does adds up.

See Pati, Rezaiifar, Krishnaprasad, "Orthogonal matching pursuit", Asilomar Conference, 1993.
"""

from __future__ import annotations

from collections.abc import Set

import numpy as np
from numpy.typing import NDArray

from residual.gap.fitting.screening import Signatures, Variant, constrained, gains, project_out
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.search.pool import Key
from residual.gap.search.redundant import by_points
from residual.gap.search.sets import Proposals, Search

Array = NDArray[np.float64]

#: Part of what is left that one more effect has to take off, and part of the whole below which the
#: linear picture is no longer believed.
PAYS, LITTLE = 0.2, 0.05


def add_pursued(search: Search) -> list[Key]:
    """Fit sets of one, two, ... effects, as long as one more pays and none is absurd; once more
    without those of inputs and sensors: without most of either there is next to no gap.

    Returns those that may be right.

    Args:
        search: Of a system without impacts, with nothing free beside every set; otherwise nothing
            is fitted.
    """
    if search.beside or not isinstance(search.fitter, SmoothFitter):
        return []
    without = set(by_points(search))
    ends = {
        number
        for number, one in enumerate(search.candidates)
        if one.effect.enters in ("actuator", "sensor")
    }
    found: list[Key] = []
    for left_out in (without, without | ends):
        for key, theta in pursued(search, left_out).items():
            if search.late:
                break
            found += search.add({key: theta})
            if key in search.refused:
                break
    return [key for key in found if search.sound(key)]


def pursued(search: Search, without: Set[int]) -> Proposals:
    """Sets of one, two, ... candidates, but for some, with start values."""
    found = search.measured_path.offered
    residual, matrix = found.residual, found.matrix
    chosen: list[Variant] = []
    proposed: Proposals = {}
    whole = left = float(residual @ residual)
    while len(chosen) < search.effort.most and left > LITTLE * whole:
        taken = without | {variant.candidate for variant in chosen}
        ranked = gains(found, residual, matrix)
        for gain in ranked:
            variant = found.variants[gain.variants[0]]
            key = tuple(sorted([*(v.candidate for v in chosen), variant.candidate]))
            if variant.candidate not in taken and search.fits_in(key):
                break
        else:
            return proposed
        if gain.value < PAYS * left:
            return proposed
        chosen.append(variant)
        starts, residual = _fitted(found, chosen)
        left = float(residual @ residual)
        columns = [c for v in chosen for c in v.columns]
        matrix = project_out(found.matrix[:, columns], found.matrix)
        key, theta = search.merged((), starts)
        proposed[key] = theta
    return proposed


def _fitted(found: Signatures, chosen: list[Variant]) -> tuple[list[tuple[int, Array]], Array]:
    """Candidates of some variants with their start values together, and what they leave."""
    columns = [c for variant in chosen for c in variant.columns]
    sides = np.concatenate([variant.trial.one_sided for variant in chosen])
    _, size = constrained(found.matrix[:, columns], found.residual, sides)
    ends = np.cumsum([len(variant.columns) for variant in chosen])[:-1]
    parts = zip(chosen, np.split(size, ends), strict=True)
    starts = [(variant.candidate, variant.start(own)) for variant, own in parts]
    return starts, found.residual - found.matrix[:, columns] @ size
