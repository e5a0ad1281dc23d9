"""Inputs that follow what was measured in every row, as those of a controller with one goal.

The motion is that of a system without inputs then, and laws in proportion to a state or an input
lie in each other's place: a load, or a gain and a time constant together. Without goals that change
a simple controller's loop tells no more (L. Ljung, "System Identification", 2nd edition, Prentice
Hall 1999, section 13.4).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.samples import Samples
from residual.gap.search.sets import Search
from sims.effects.actuator import ActuatorBias, ActuatorGain
from sims.effects.joint import LinearSpring, NegativeStiffness, ViscousFriction
from sims.effects.loss import ProportionalLoss
from sims.effects.sensor import ScaledSensor

Array = NDArray[np.float64]

#: Laws in proportion to a state or an input.
LINEAR = (
    ActuatorGain | LinearSpring | NegativeStiffness | ProportionalLoss | ScaledSensor
    | ViscousFriction
)  # fmt: skip
#: Part of an input's standard deviation that an affine law of the states misses at the most.
MISSED = 0.05
#: Values from which on an input is more than switched, and rows for every number of the law.
SWITCHED, ROWS = 5, 10


def affine(search: Search, number: int) -> bool:
    """Whether an effect is in proportion to a state or an input, or a constant, or moves exactly as
    one that is."""
    effects = [one.effect for one in (search.candidates[number], *search.twins_of(number))]
    return any(isinstance(e, LINEAR) or e.family == ActuatorBias.family for e in effects)


def fed_back(samples: Samples) -> bool:
    """Whether every input that changes is an affine function of what was measured in its row, or in
    the one before, up to its limits."""
    changing = [j for j in range(samples.actions.shape[1]) if np.ptp(samples.actions[:, j]) > 0]
    return bool(changing) and any(
        all(_follows(samples, j, late) for j in changing) for late in (0, 1)
    )


def _follows(samples: Samples, column: int, late: int) -> bool:
    rows = np.concatenate([np.arange(start + late, stop) for start, stop in samples.runs])
    given, seen = samples.actions[rows, column], samples.seen[rows - late][:, samples.measured]
    known = np.isfinite(seen).all(axis=1)
    given, law = given[known], np.column_stack([seen, np.ones(len(seen))])[known]
    least, most = given.min(initial=np.inf), given.max(initial=-np.inf)
    free = (given > least) & (given < most)
    if free.sum() < ROWS * law.shape[1] or len(np.unique(given)) < SWITCHED:
        return False
    told = law @ np.linalg.lstsq(law[free], given[free], rcond=None)[0]
    missed = given - np.clip(told, least, most)
    return bool(missed.std() < MISSED * given.std())
