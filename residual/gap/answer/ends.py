"""What a parameter is where records begin and where they end, fitted to each half of them.

The linear picture around a constant goes astray where a parameter changes much: a mass that falls
from 14 to 9.5 kg would end at 6.8. Where it does not it is better, since it rests on all records.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from residual.gap.answer.confirmed import Answer
from residual.gap.beside import Changing
from residual.gap.data.windows import TooShort
from residual.gap.model.candidates import candidates
from residual.gap.model.model import Model
from residual.gap.preparation.prepare import prepare
from residual.trajectories import Trajectory
from sims.effects.library import library

#: Part of its middle by which a parameter has to change.
MUCH = 0.4


def with_fitted_ends(
    told: Changing | None, answer: Answer, runs: Sequence[Trajectory], horizon: float
) -> Changing | None:
    """What changes much along the records, its ends from a fit to the first half of each and to the
    second, the rest free; as it was told where halves are too short, or do not change so.

    Args:
        told: What changes.
        answer: What was named.
        runs: What was searched.
        horizon: Length of forecasts in s.
    """
    if told is None or told.over or abs(told.end - told.begin) < MUCH * _middle(told):
        return told
    values = []
    for half in (0, 1):
        try:
            values.append(_of_half(told, answer, [_half(run, half) for run in runs], horizon))
        except TooShort:
            return told
    change = values[1] - values[0]
    if not np.isfinite(values).all() or change * (told.end - told.begin) <= 0:
        return told
    # A half has its own middle at a quarter of the way.
    begin, end = values[0] - change / 2, values[1] + change / 2
    if begin * values[0] <= 0 or end * values[1] <= 0:
        return told
    return dataclasses.replace(told, begin=begin, end=end)


def _middle(told: Changing) -> float:
    """Its size half-way, of a gain that of the factor."""
    return abs(0.5 * (told.begin + told.end) + (told.unit == "1" and told.nominal == 0))


def _half(run: Trajectory, half: int) -> Trajectory:
    middle = len(run.times) // 2
    return run.piece(middle, len(run.times)) if half else run.piece(0, middle + 1)


def _of_half(told: Changing, answer: Answer, runs: Sequence[Trajectory], horizon: float) -> float:
    """The value that fits half of the records."""
    search, simulator = answer.found.search, answer.found.search.simulator
    fit = search.tried[answer.key]
    ready = prepare(simulator, runs, horizon)
    effect = next(one for one in library(simulator) if str(one) == told.label)
    (one,) = candidates(simulator, [effect], ready.fitter.samples)
    kept, places = [], []
    for i, candidate in enumerate(fit.model.chosen):
        if not told.instead and candidate.label != told.label:
            kept.append(candidate)
            places += np.flatnonzero(fit.model.owner == i).tolist()
    start = np.append(fit.theta[places], 0.5 * (told.begin + told.end) - told.nominal)
    nominal = ready.fitter.fit(Model(simulator), np.zeros(0))
    found = ready.fitter.fit(Model(simulator, [*kept, one]), start, nominal)
    return float(found.theta[-1]) + told.nominal
