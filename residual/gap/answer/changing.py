"""A parameter, or a gain, that changes along the records about what the simulator takes it for.

A rope is hauled in, an outlet clogs, a battery sags. No effect of the library depends on time, and
one whose mean is right does not stand out either: the gap stays, and has no name.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.answer.confirmed import Answer
from residual.gap.answer.left import NOTABLE
from residual.gap.beside import Changing
from residual.gap.confirmation.constancy import (
    CHANCE,
    FEW,
    along_records,
    along_windows,
    change_over,
)
from residual.gap.confirmation.drift import Drift, Fall, beside
from residual.gap.fitting.contract import Fit
from residual.gap.fitting.screening import beside_starts
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.model.candidates import Candidate, candidates
from residual.gap.search.sets import Key, Search
from sims.effects.actuator import ActuatorGain
from sims.effects.library import library
from sims.effects.parameter import ParameterChange

Array = NDArray[np.float64]

#: Part of what is left, without its change along the records, that it may leave.
HALF = 0.5
#: Times that a change of what is named has to leave more.
CLEARLY = 1.5


def changing(answer: Answer) -> Changing | None:
    """The parameter or gain whose change along the records would take most of what is left off.

    It has to take off half of what it leaves as a constant, more than chance, more than a push that
    drifts, and clearly more than a change of what is named: of that both ends are told anyway.
    """
    found, search, key = answer.found, answer.found.search, answer.key
    fitter, fit = search.fitter, search.tried[answer.key]
    if not isinstance(fitter, SmoothFitter) or len(fitter.blocks) < FEW or found.adequate:
        return None
    if fitter.left(fit, found.floor).ratio < NOTABLE:
        return None
    pool, named = _pool(search, key), search.numbers(key)
    best: tuple[Fall, Candidate, int | None] | None = None
    for one in pool:
        free = _place(fit, one)
        constant = [] if free is not None else [_column(fitter, fit, one)]
        course = _own_course(search, fit, free) if free is not None else _column(
            fitter, fit, one, along_records(search)
        )  # fmt: skip
        fixed, moved = (beside(fit, c, fitter.cap) for c in (constant, [*constant, course]))
        if moved.loss > HALF * fixed.loss or (best and moved.loss >= best[0].loss):
            continue
        if _clear(search, fit, constant, free, CHANCE / len(pool)):
            best = (moved, one, free)
    own = [beside(fit, [_own_course(search, fit, j)], fitter.cap).loss for j in range(named)]
    least = min([Drift(search).least(key), *(loss / CLEARLY for loss in own)])
    if best is None or best[0].loss >= least:
        return None
    moved, one, free = best
    mean = float(moved.numbers[0] if free is None else moved.theta[free])
    change = float(moved.numbers[-1])
    (knob,), nominal, unit = one.knobs, 0.0, "1"
    if isinstance(one.effect, ParameterChange):
        nominal, unit = float(search.simulator.parameters[one.effect.parameter].value), knob.unit
    ends = np.clip([mean - change / 2, mean + change / 2], knob.low, knob.high) + nominal
    taken = 1 - moved.loss / max(fit.merit, 1e-300)
    return Changing(one.label, float(ends[0]), float(ends[1]), nominal, unit, taken)


def _pool(search: Search, key: Key) -> list[Candidate]:
    """Parameters and gains that are not named already."""
    named = set(search.labels(key))
    effects = [
        effect
        for effect in library(search.simulator)
        if isinstance(effect, ParameterChange | ActuatorGain) and str(effect) not in named
    ]
    return candidates(search.simulator, effects, search.fitter.samples)


def _column(fitter: SmoothFitter, fit: Fit, one: Candidate, share: Array | None = None) -> Array:
    """What a candidate does to every window by unit of its number, (W, R, 1)."""
    size = float(one.trials[0].values[0, 0])
    return beside_starts(fit, fitter.columns(fit, [one], share)[..., :1]) / size


def _own_course(search: Search, fit: Fit, j: int) -> Array:
    """What a number of a fit does that changes along the records, (W, R, 1)."""
    return (fit.by_knob[..., j] * along_windows(search)[:, None])[..., None]


def _place(fit: Fit, one: Candidate) -> int | None:
    """Where the number of a candidate stands among those of a fit; None if it is not free there."""
    labels = [chosen.label for chosen in fit.model.chosen]
    if one.label not in labels:
        return None
    return int(np.flatnonzero(fit.model.owner == labels.index(one.label))[0])


def _clear(
    search: Search, fit: Fit, given: Sequence[Array], free: int | None, chance: float
) -> bool:
    """Whether a change along the records is more than chance, by blocks."""
    if free is None:
        by_knob = np.concatenate([fit.by_knob, *given], axis=2)
        free = len(fit.theta)
        fit = dataclasses.replace(fit, theta=np.append(fit.theta, 0.0), by_knob=by_knob)
    course = along_windows(search)
    return change_over(fit, search.fitter.blocks.block, free, course, chance) != 0.0
