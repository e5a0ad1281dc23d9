"""A remainder that repeats at one frequency: a vibration, a ripple, a disturbance without a log.

The spectrum of what single steps leave tells the frequency; whether a force on a joint that swings
so, in every record from its own beginning, takes most of the remainder off, the windows do. What
inputs do at that frequency, or at a fraction of it, is no disturbance: a drive that swings makes
harmonics of whatever is missing, and so does a pendulum that swings freely.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from residual.gap.answer.confirmed import Answer
from residual.gap.answer.left import half_beyond_noise
from residual.gap.beside import Periodic
from residual.gap.confirmation.drift import beside
from residual.gap.data.samples import Samples
from residual.gap.data.spectrum import line, swings
from residual.gap.fitting.screening import beside_starts
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.model import paths
from residual.gap.model.candidates import candidates
from residual.gap.search.explain import NOTABLE
from residual.gap.search.pool import Key
from sims.effects.flexible import FlexiblePart
from sims.effects.joint import ConstantLoad

Array = NDArray[np.float64]

#: Whole parts of the frequency at which inputs must not swing, nor, but for itself, motion.
FRACTIONS = (1, 2, 3, 4, 5)


def periodic(answer: Answer) -> Periodic | None:
    """The joint and frequency of a force that would take most of what is left off, if there is one;
    or of what a part on a spring leaves if it is taken out.

    Such a part swings from a state of its own in every window, and stands for whatever swings so.

    Args:
        answer: What was named.
    """
    if found := _repeating(answer, answer.key):
        return found
    search = answer.found.search
    for claim in answer.claims:
        effect = search.candidates[claim.number].effect
        rest = tuple(number for number in answer.key if number != claim.number)
        asked = isinstance(effect, FlexiblePart) and rest in search.tried
        if asked and (found := _repeating(answer, rest)):
            return dataclasses.replace(found, instead=str(effect))
    return None


def _repeating(answer: Answer, key: Key) -> Periodic | None:
    """The same of what a set leaves."""
    search = answer.found.search
    fitter, fit = search.fitter, search.tried[key]
    if not isinstance(fitter, SmoothFitter):
        return None
    left = fitter.left(fit, answer.found.floor)
    if left.adequate or left.ratio < NOTABLE:
        return None
    samples, model = fitter.samples, fit.model
    _, steps = paths.misses(model, samples, fit.theta)
    names = [channel.name for channel in search.simulator.physical_channels]
    best, least = None, half_beyond_noise(answer, fit.merit)
    for joint in search.simulator.joints:
        series = steps[:, names.index(joint.rate or joint.position)]
        frequency = line(samples, series)
        if frequency is None or _driven(samples, frequency):
            continue
        phase = 2 * np.pi * frequency * samples.times
        waves = [
            np.where(_of_run(samples, run), wave, 0.0)
            for run in samples.runs
            for wave in (np.cos(phase), np.sin(phase))
        ]
        (load,) = candidates(model.simulator, [ConstantLoad(joint.name)], samples)
        by_load = beside_starts(fit, fitter.columns(fit, [load], np.stack(waves)))
        fall = beside(fit, [by_load], fitter.cap)
        if fall.loss < least:
            sizes = float(load.trials[0].values[0, 0]) * fall.numbers.reshape(-1, 2)
            size = float(np.median(np.hypot(*sizes.T)))
            taken, unit = 1 - fall.loss / max(fit.merit, 1e-300), load.knobs[0].unit
            best, least = Periodic(joint.name, frequency, size, unit, taken), fall.loss
    return best


def _driven(samples: Samples, frequency: float) -> bool:
    """Whether an input swings at a frequency or at a fraction of it, or motion at a fraction."""
    asked: list[tuple[Array, tuple[int, ...]]]
    asked = [(series, FRACTIONS) for series in samples.actions.T]
    asked += [(samples.seen[:, column], FRACTIONS[1:]) for column in samples.measured]
    return any(
        swings(samples, series, [frequency / part for part in parts]) for series, parts in asked
    )


def _of_run(samples: Samples, run: tuple[int, int]) -> NDArray[np.bool_]:
    rows = np.arange(len(samples))
    return (rows >= run[0]) & (rows < run[1])
