"""Parameters that may follow a state or an input: when to ask for their curves."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.answer.changing import Course, courses_of
from residual.gap.answer.confirmed import Answer
from residual.gap.answer.left import fit_in_place_of_most, half_beyond_noise, much_is_left
from residual.gap.answer.likeness import in_any_motion
from residual.gap.data.levels import levels
from residual.gap.fitting.screening import gains, project_out
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.model.candidates import candidates
from residual.gap.search.at_sight import at_sight
from residual.gap.search.explain import NOTABLE
from residual.gap.search.pool import Key
from residual.gap.search.sets import Search
from sims.effects.curve import Curve
from sims.effects.parameter import ParameterChange
from sims.effects.parameter_curve import ParameterCurve, ParameterSpline

Array = NDArray[np.float64]

#: Times what the best of them leaves, up to which others are asked for, and how many at the most.
NEARLY, MOST = 2.0, 4


def worth_varying(
    answer: Answer, curves: Sequence[Curve], offered: Collection[str]
) -> list[ParameterCurve]:
    """The parameters that follow a channel in the linear picture, to ask for.

    Those that do in any motion what a curve by points does are left to that: a damper that follows
    its own speed is a friction by speed.

    Args:
        answer: What was found with the effects on offer.
        curves: Curves by points that are asked for, too.
        offered: Labels of the effects that may be missing.
    """
    search = answer.found.search
    if not (isinstance(search.fitter, SmoothFitter) and search.simulator.written_out):
        return []
    courses = _beside(answer, answer.key) or _from_the_nominal(answer)
    near = [one for one in courses if one.fall.loss <= NEARLY * courses[0].fall.loss]
    found = [one.curve for one in near if one.curve and one.curve.parameter in offered]
    found = [*_at_sight(answer, offered), *found] or _in_place_of_most(answer, offered)
    own = _that_are_no_law(answer, found, curves)
    # Beside what was named another parameter may show that alone would explain all.
    names = [name for name in search.simulator.parameters if name in offered]
    others = [dataclasses.replace(one, parameter=name) for one in own for name in names]
    return list(dict.fromkeys([*own, *others]))[:MOST]


def _that_are_no_law(
    answer: Answer, asked: Sequence[ParameterCurve], laws: Sequence[Curve]
) -> list[ParameterCurve]:
    """Those that no curve by points can do in any motion, nor if they followed the size of their
    channel, or all of it."""
    search = answer.found.search
    assert isinstance(search.fitter, SmoothFitter)
    can = functools.partial(in_any_motion, search.fitter, search.simulator)
    done = {(one.parameter, one.over) for one in asked if any(can(law, one) for law in laws)}
    return [one for one in asked if (one.parameter, one.over) not in done]


def _beside(answer: Answer, key: Key) -> list[Course]:
    """What changes with a channel beside a set."""
    return [one for one in courses_of(answer, key) if one.level is not None]


def _from_the_nominal(answer: Answer) -> list[Course]:
    """What changes with a channel and alone leaves half of what all that was named leaves: laws
    that imitate what changes leave nothing of its shape.
    """
    if not much_is_left(answer):
        return []
    most = half_beyond_noise(answer, answer.found.search.tried[answer.key].merit)
    return [one for one in _beside(answer, ()) if one.fall.loss < most]


def _at_sight(answer: Answer, offered: Collection[str]) -> list[ParameterCurve]:
    """The parameters that, if they follow a channel, leave a fraction of what the library does
    along the measured path, those that leave least first: what changes many times over does not
    show around the simulator's own."""
    search = answer.found.search
    if not much_is_left(answer):
        return []
    few, path = _every_one(answer, offered), search.measured_path
    curves = [*few, *map(_spline, few)]
    pool = at_sight(path, candidates(search.simulator, curves, search.fitter.samples))
    if not pool:
        return []
    found, by_label = path.of(pool), {str(curve): curve for curve in curves}
    taken: dict[ParameterCurve, float] = {}
    for gain in gains(found):
        curve = by_label[pool[found.variants[gain.variants[0]].candidate].label]
        taken.setdefault(curve, gain.value)
    enough = {_spline(one) for one in few if one in taken}
    return [one for one in taken if one not in enough and taken[one] > _by_record(search, one)]


def _by_record(search: Search, curve: ParameterCurve) -> float:
    """What the parameter of a curve takes off along the measured path with a size of its own in
    each record; 0 of more records than the curve has points. Where a position is left from record
    to record as it was, what follows it tells the records apart."""
    assert isinstance(search.fitter, SmoothFitter)
    run, change = search.fitter.blocks.windows.run, ParameterChange(curve.parameter)
    if len(np.unique(run)) > len(curve.strengths()):
        return 0.0
    found = search.measured_path.of(candidates(search.simulator, [change], search.fitter.samples))
    of_row = np.repeat(run, len(found.residual) // len(run))
    apart = found.matrix[:, :1] * (of_row[:, None] == np.unique(run))
    left = project_out(apart, found.residual[:, None])
    return float(found.residual @ found.residual - (left**2).sum())


def _in_place_of_most(answer: Answer, offered: Collection[str]) -> list[ParameterCurve]:
    """The parameters that, if they follow a channel, fit about as well as all but one that was
    named: a change that makes most of the gap is no small one, for which the linear picture holds.
    """
    search = answer.found.search
    if not much_is_left(answer):
        return []
    curves = _every_one(answer, offered)
    pool = candidates(search.simulator, curves, search.fitter.samples)
    return [curves[n] for n in sorted(fit_in_place_of_most(pool, answer))]


def _every_one(answer: Answer, offered: Collection[str]) -> list[ParameterCurve]:
    """Every one of some parameters over every channel."""
    search = answer.found.search
    return [
        ParameterCurve(name, level.channel, of_size=level.of_size).suited_to(*level.reach)
        for level in levels(search.simulator, search.fitter.samples)
        for name in search.simulator.parameters
        if name in offered
    ]


def over_unused(
    answer: Answer, offered: Collection[str], unused: Collection[str]
) -> list[ParameterCurve]:
    """Every parameter over inputs that make no difference to the simulator, while clearly more than
    noise is left: whoever leaves such an input in it expects that.

    None is left out for what the linear picture says: that holds near the simulator's own values,
    and an input that is not used may change a parameter many times over.

    Args:
        answer: What was found with the effects on offer.
        offered: Labels of the effects that may be missing.
        unused: Names of those inputs.
    """
    search = answer.found.search
    simulator, fitter = search.simulator, search.fitter
    if not (isinstance(fitter, SmoothFitter) and simulator.written_out and much_is_left(answer)):
        return []
    return [
        ParameterCurve(name, level.channel).suited_to(*level.reach)
        for level in levels(simulator, fitter.samples)
        if level.channel in unused and not level.of_size
        for name in simulator.parameters
        if name in offered
    ][:MOST]


def over_other_channels(answer: Answer, curves: Sequence[Curve]) -> list[ParameterCurve]:
    """The parameters that were named as following a channel, over all others that were not asked
    for: what grows and what it makes go together, and either may be what slows the growth.

    Args:
        answer: What was found.
        curves: Curves by points that are asked for, too.
    """
    search = answer.found.search
    effects = [search.candidates[number].effect for number in answer.key]
    named = [effect.parameter for effect in effects if isinstance(effect, ParameterCurve)]
    asked = {candidate.label for candidate in search.candidates}
    others = [one for one in _every_one(answer, named) if str(one) not in asked]
    return _that_are_no_law(answer, others, curves) if others else []


def through_more_points(answer: Answer) -> list[ParameterSpline]:
    """The parameters that were named as following a channel, through more points: three are a
    parabola, and no place where a rail is worn, nor a law that grows tenfold."""
    if answer.left.adequate:
        return []
    effects = [answer.found.search.candidates[number].effect for number in answer.key]
    curves = [one for one in effects if isinstance(one, ParameterCurve)]
    return [_spline(one) for one in curves if not isinstance(one, ParameterSpline)]


def _spline(curve: ParameterCurve) -> ParameterSpline:
    """The same through more points."""
    return ParameterSpline(
        curve.parameter, curve.over, low=curve.low, high=curve.high, of_size=curve.of_size
    )


def no_surer(answer: Answer, earlier: Answer) -> Answer:
    """An answer in which a parameter follows a channel, nothing surer than before where clearly
    more than noise is left: it takes the shape of whatever is missing, and what it leaves others
    that of it.
    """
    if answer.found.adequate or answer.left.ratio < NOTABLE:
        return answer
    known = earlier.found.search.candidates
    sure = {known[claim.number].label for claim in earlier.claims if claim.sure}
    labels = answer.found.search.candidates
    claims = tuple(
        dataclasses.replace(
            claim, other_law=claim.other_law or labels[claim.number].label not in sure
        )
        for claim in answer.claims
    )
    return dataclasses.replace(answer, claims=claims)
