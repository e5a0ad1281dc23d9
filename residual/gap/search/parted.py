"""Exact twins that are none beside what else was chosen.

A bias of an input and a load on what it drives are one motion of the nominal simulator, so one of
them is offered. Behind a dead zone they are two: there the bias decides where the dead zone lies.
"""

from __future__ import annotations

import numpy as np

from residual.gap.fitting.screening import beside_starts, flatten, project_out, trials
from residual.gap.model.candidates import Candidate
from residual.gap.search.pool import Key
from residual.gap.search.sets import Search

#: Part of what a twin does, in the linear picture, that a set with the effect itself cannot, from
#: which on it moves otherwise: secants of trials differ by less.
OTHERWISE = 0.03


def parted(search: Search, key: Key) -> list[tuple[int, Candidate]]:
    """Members of a fitted set, each with an exact twin that moves otherwise beside the others."""
    pool = [(number, twin) for number in key for twin in search.twins_of(number)]
    if len(key) < 2 or not pool or search.simulator.has_contacts:
        return []
    fit, variants = search.tried[key], trials([twin for _, twin in pool])
    columns = search.fitter.columns(fit, [twin for _, twin in pool])
    moved = flatten(beside_starts(fit, columns), fit.weights)
    left = project_out(flatten(fit.by_knob, fit.weights), moved)
    sizes, rests = (np.linalg.norm(one, axis=0) for one in (moved, left))
    otherwise = {
        variant.candidate
        for variant in variants
        if all(rests[c] > OTHERWISE * sizes[c] for c in variant.columns)
    }
    return [pool[place] for place in sorted(otherwise)]


def add_parted(search: Search, key: Key) -> None:
    """Fit a set with each of these twins in place of the member."""
    for number, twin in parted(search, key):
        search.add_twin(key, number, twin)
