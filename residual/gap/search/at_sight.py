"""Rarer effects that stand out beside the library before anything is fitted."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.fitting.screening import Signatures, gains, pair_gains, project_out
from residual.gap.model.candidates import Candidate
from residual.gap.search.measured_path import MeasuredPath
from sims.effects.base import Effect

Array = NDArray[np.float64]

#: Part of what the library's best effects leave that one of these leaves at most; where these leave
#: but a twentieth of the cost.
QUARTER, TENTH, LITTLE = 0.25, 0.1, 0.05
#: Part of what one leaves that two leave at most.
HALF = 0.5
#: Effects of the library beside which others are looked at, one after the other.
BESIDE = 3


def at_sight(path: MeasuredPath, further: Sequence[Candidate]) -> list[Candidate]:
    """Those that leave a fraction of what the best of the library leaves in the linear picture,
    alone, or two that belong together; beside nothing, or beside the library's best effects.

    What acts in two places, or is two effects, has to leave less than two of the library do.

    Args:
        path: With what is on offer.
        further: What is not.
    """
    if not further:
        return []
    own, others = path.offered, path.of(further)
    whole = float(own.residual @ own.residual)
    after = _library(own)
    left = [float(residual @ residual) for _, residual in after]
    found: set[int] = set()
    for beside in range(BESIDE):
        part = QUARTER if left[beside + 1] >= LITTLE * whole else TENTH
        basis, residual = after[beside]
        matrix = project_out(basis, others.matrix)
        there = dataclasses.replace(others, residual=residual, matrix=matrix)
        most = [part * one for one in left[beside + 1 : beside + 3]]
        found |= _standing_out(there, further, left[beside], most)
    return [one for number, one in enumerate(further) if number in found]


def _library(own: Signatures) -> list[tuple[Array, Array]]:
    """Columns of none of the library's effects, of the best, of the best two and so on, one after
    the other, and what they leave, (rows,)."""
    columns: list[int] = []
    found = []
    for _ in range(BESIDE + 2):
        basis = own.matrix[:, columns]
        residual, matrix = (project_out(basis, one) for one in (own.residual, own.matrix))
        found.append((basis, residual))
        for gain in gains(own, residual, matrix)[:1]:
            columns += own.variants[gain.variants[0]].columns
    return found


def _standing_out(
    others: Signatures, further: Sequence[Candidate], cost: float, most: Sequence[float]
) -> set[int]:
    """Numbers of those that leave less than ``most[0]`` of a cost alone, or, in two places or with
    one of their pair, less than ``most[1]``."""
    alone = dict.fromkeys(range(len(further)), 0.0)
    for gain in gains(others):
        number = others.variants[gain.variants[0]].candidate
        alone[number] = max(alone[number], gain.value)
    places = {number: 1 if one.effect.pair else 0 for number, one in enumerate(further)}
    found = {number for number, value in alone.items() if cost - value < most[places[number]]}
    for two in of_one_pair(further):
        both = cost - _together(others, two)
        if both < most[1] and both < HALF * (cost - max(alone[n] for n in two)):
            found |= set(two)
    return found


def of_one_pair(pool: Sequence[Candidate]) -> list[tuple[int, int]]:
    """Numbers of two effects between the same two joints, or of two that come together: a gyroscope
    couples its axes both ways, a belt is a spring and a damper, a way has two ends."""
    effects = [one.effect for one in pool]
    both = itertools.combinations(range(len(pool)), 2)
    return [(a, b) for a, b in both if _belong(effects[a], effects[b])]


def _belong(one: Effect, other: Effect) -> bool:
    if one.pair:
        return sorted(one.pair) == sorted(other.pair)
    together = one.name == other.comes_with or other.name == one.comes_with
    return together and one.where == other.where


def _together(found: Signatures, two: tuple[int, int]) -> float:
    """What two candidates take off the cost together."""
    others = {variant.candidate for variant in found.variants} - set(two)
    return max((gain.value for gain in pair_gains(found, 1, without=tuple(others))), default=0.0)
