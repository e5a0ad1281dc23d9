"""A parameter, or a gain, that changes about what the simulator takes it for.

A rope is hauled in, an outlet clogs, a battery sags; a resistance falls as it warms. No effect of
the library depends on time, or makes a parameter follow a state, and one whose mean is right does
not stand out either: the gap stays, and has no name.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.answer.confirmed import Answer
from residual.gap.answer.left import HALF, half_beyond_noise
from residual.gap.beside import Changing
from residual.gap.confirmation.constancy import (
    CHANCE,
    FEW,
    along_records,
    along_windows,
    clear_number,
)
from residual.gap.confirmation.drift import Drift, Fall, beside
from residual.gap.data.levels import Level, levels
from residual.gap.fitting.contract import Fit
from residual.gap.fitting.plausible import FACTOR
from residual.gap.fitting.screening import beside_starts
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.model.candidates import Candidate, candidates
from residual.gap.search.explain import NOTABLE
from residual.gap.search.known import ANY_ZERO, size
from residual.gap.search.pool import Key
from residual.gap.search.sets import Search
from sims.effects.actuator import ActuatorGain
from sims.effects.library import library
from sims.effects.parameter import ParameterChange
from sims.effects.parameter_curve import ParameterCurve

Array = NDArray[np.float64]

#: Times that a change of what is named has to leave more.
CLEARLY = 1.5


def changing(answer: Answer, in_vain: Collection[ParameterCurve] = ()) -> Changing | None:
    """The parameter or gain whose change along the records, or with what was measured, would take
    most of what is left off.

    Of what is beyond noise it has to take off half of what it leaves as a constant, more than
    chance, more than a push that drifts, and clearly more than a change along the records of what
    is named: of that both ends are told anyway. With a measured channel that has to be clearly more
    than along the records. What would go ten times beyond its value, or to the other sign, is none.
    Where it alone, from the nominal simulator on, leaves half of all that, it stands in place of
    what is named: laws that imitate what changes leave nothing of its shape.

    Args:
        answer: What was named.
        in_vain: Parameters that follow a channel, asked for in full and not named.
    """
    search = answer.found.search
    asked = {str(curve) for curve in in_vain}
    told, left = _best(answer, answer.key, asked) or (None, search.tried[answer.key].merit)
    much = isinstance(search.fitter, SmoothFitter) and answer.left.ratio > NOTABLE
    alone = _best(answer, (), asked) if answer.key and much else None
    if alone is not None and alone[1] < half_beyond_noise(answer, left):
        return dataclasses.replace(alone[0], instead=True)
    return told


def _best(answer: Answer, key: Key, asked: Collection[str]) -> tuple[Changing, float] | None:
    """The first course beside a set that may be, but for curves that were asked for, and what it
    leaves."""
    search = answer.found.search
    for course in courses_of(answer, key):
        ends = course.told(search, search.tried[key])
        if str(course.curve) not in asked and _believable(search, course, ends):
            return ends, course.fall.loss
    return None


def in_place(changing: Changing | None, along_records: bool) -> bool:
    """Whether what changes along the records, or with a channel, would do in place of all names."""
    return changing is not None and changing.instead and bool(changing.over) != along_records


def courses_of(answer: Answer, key: Key | None = None) -> list[Course]:
    """What ``changing`` is chosen of, best first: several only of those with a channel; beside a
    set, by default what was named."""
    found, search = answer.found, answer.found.search
    key = answer.key if key is None else key
    fitter, fit = search.fitter, search.tried[key]
    if not isinstance(fitter, SmoothFitter) or len(fitter.blocks) < FEW or found.adequate:
        return []
    if fitter.left(fit, found.floor).ratio < NOTABLE:
        return []
    by_noise = fitter.noise_alone(found.floor.sigma)
    over_time = _clear(search, key, [None], by_noise, named=False)
    levelled = list(levels(search.simulator, fitter.samples))
    over_level = _clear(search, key, levelled, by_noise, named=True) if levelled else []

    def clearly_below(losses: Iterable[float]) -> list[float]:
        return [by_noise + max(loss - by_noise, 0.0) / CLEARLY for loss in losses]

    own = (
        beside(fit, [_own_course(search, fit, j)], fitter.cap).loss
        for j in range(search.numbers(key))
    )
    least = min([Drift(search).least(key), *clearly_below(own)])
    over_time = [one for one in over_time if one.fall.loss < least][:1]
    least = min([least, *clearly_below(one.fall.loss for one in over_time)])
    return [one for one in over_level if one.fall.loss < least] or over_time


@dataclasses.dataclass(frozen=True)
class Course:
    """A parameter or gain that changes over a course.

    Attributes:
        one: It.
        free: Where its number stands in the fit; None if it is not free there.
        level: What it follows; None along the records.
        fall: What is left beside it.
    """

    one: Candidate
    free: int | None
    level: Level | None
    fall: Fall

    @property
    def curve(self) -> ParameterCurve | None:
        """It as an effect, over all that was measured; None of a gain, and along the records."""
        level, effect = self.level, self.one.effect
        if level is None or not isinstance(effect, ParameterChange):
            return None
        curve = ParameterCurve(effect.parameter, level.channel, of_size=level.of_size)
        return curve.suited_to(*level.reach)

    def told(self, search: Search, fit: Fit) -> Changing:
        """Its ends."""
        (knob,), nominal, unit = self.one.knobs, 0.0, "1"
        effect, moved, level = self.one.effect, self.fall, self.level
        if isinstance(effect, ParameterChange):
            value = search.simulator.parameters[effect.parameter].value
            nominal, unit = float(value), knob.unit
        mean = float(moved.numbers[0] if self.free is None else moved.theta[self.free])
        change = float(moved.numbers[-1])
        ends = np.clip([mean - change / 2, mean + change / 2], knob.low, knob.high) + nominal
        taken = 1 - moved.loss / max(fit.merit, 1e-300)
        told = Changing(self.one.label, float(ends[0]), float(ends[1]), nominal, unit, taken)
        if level is None:
            return told
        return dataclasses.replace(
            told, over=level.channel, of_size=level.of_size, low=level.low, high=level.high,
            over_unit=level.unit,
        )  # fmt: skip


def _believable(search: Search, course: Course, ends: Changing) -> bool:
    """Whether both ends are values that a parameter, or the factor of a gain, may well have, and
    not one and the same bound."""
    effect, usual, nominal = course.one.effect, 1.0, ends.nominal
    if isinstance(effect, ParameterChange):
        usual = size(search, effect.parameter)
    signed = isinstance(effect, ParameterChange) and ends.unit not in ANY_ZERO
    if ends.begin == ends.end:
        return False
    return not usual or all(
        abs(end - nominal) <= FACTOR * usual and not (signed and end * nominal < 0)
        for end in (ends.begin, ends.end)
    )


def _clear(
    search: Search, key: Key, courses: Sequence[Level | None], by_noise: float, named: bool
) -> list[Course]:
    """What is clear over one of the courses and leaves half at most, what leaves least first.

    Args:
        courses: Levels, or None for along the records.
        by_noise: What noise alone leaves.
        named: Whether parameters and gains that are named are asked, too.
    """
    fitter, fit = search.fitter, search.tried[key]
    assert isinstance(fitter, SmoothFitter)
    pool, found = _pool(search, () if named else key), []
    along = [along_records(search) if one is None else one.course for one in courses]
    for one in pool:
        free = _place(fit, one)
        constant, *moved_by = _columns(fitter, fit, one, [np.ones_like(along[0]), *along])
        given = [] if free is not None else [constant]
        fixed = beside(fit, given, fitter.cap)
        for level, course in zip(courses, moved_by, strict=True):
            if level is None and free is not None:
                course = _own_course(search, fit, free)
            moved = beside(fit, [*given, course], fitter.cap)
            if moved.loss - by_noise > HALF * (fixed.loss - by_noise):
                continue
            chance = CHANCE / (len(pool) * len(courses))
            more = np.concatenate([*given, course], axis=2)
            if clear_number(fit, fitter.blocks.block, more, chance):
                found.append(Course(one, free, level, moved))
    return sorted(found, key=lambda course: course.fall.loss)


def _pool(search: Search, key: Key) -> list[Candidate]:
    """Parameters and gains that are not named already."""
    named = set(search.labels(key))
    effects = [
        effect
        for effect in library(search.simulator)
        if isinstance(effect, ParameterChange | ActuatorGain) and str(effect) not in named
    ]
    return candidates(search.simulator, effects, search.fitter.samples)


def _columns(
    fitter: SmoothFitter, fit: Fit, one: Candidate, shares: Sequence[Array]
) -> list[Array]:
    """What a candidate does to every window by unit of its number over each course, (W, R, 1)."""
    one_unit = float(one.trials[0].values[0, 0])
    moved = beside_starts(fit, fitter.columns(fit, [one], np.stack(shares))) / one_unit
    return [moved[..., [k]] for k in range(len(shares))]


def _own_course(search: Search, fit: Fit, j: int) -> Array:
    """What a number of a fit does that changes along the records, (W, R, 1)."""
    return (fit.by_knob[..., j] * along_windows(search)[:, None])[..., None]


def _place(fit: Fit, one: Candidate) -> int | None:
    """Where the number of a candidate stands among those of a fit; None if it is not free there."""
    labels = [chosen.label for chosen in fit.model.chosen]
    if one.label not in labels:
        return None
    return int(np.flatnonzero(fit.model.owner == labels.index(one.label))[0])
