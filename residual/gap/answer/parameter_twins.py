"""Parameters that would do what a law does if they followed the channel that it goes by.

Some do in any motion: a damping that follows the speed is a friction by speed. Others do as the
log goes: what falls at its final speed is at one speed wherever it is, so that a drag which follows
the height is a force by height.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from residual.gap.answer.confirmed import Answer
from residual.gap.answer.likeness import in_any_motion, is_one_of, moved
from residual.gap.answer.varying import MOST
from residual.gap.data.levels import levels
from residual.gap.fitting.contract import Fit
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.model.candidates import Candidate, candidates
from residual.gap.model.model import Model
from residual.gap.search.continuation import in_place
from sims.effects.base import Effect
from sims.effects.curve import Curve
from sims.effects.joint import CubicSpring, LinearSpring
from sims.effects.parameter_curve import ParameterCurve
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: Loss over that of a law up to which a parameter that follows a channel does the same.
AS_WELL = 1.1


def with_parameters_as_twins(answer: Answer, offered: Collection[str]) -> Answer:
    """An answer whose curves by points and springs know the parameters that would do the same if
    they followed a channel: those that do in any motion are twins, as of a curve of the speed a
    wheelbase that grows with it, others are alike in these data.

    Args:
        answer: What was found.
        offered: Labels of the effects that may be missing.
    """
    search = answer.found.search
    fitter, simulator = search.fitter, search.simulator
    if not (isinstance(fitter, SmoothFitter) and simulator.written_out):
        return answer
    claims = []
    for claim in answer.claims:
        law = search.candidates[claim.number].effect
        if _follows_one(law) and claim.sure:
            where = _position(simulator, law)
            others = [
                ParameterCurve(name, level.channel).suited_to(*level.reach)
                for level in levels(simulator, fitter.samples)
                for name, parameter in simulator.parameters.items()
                if name in offered and not level.of_size
                if not (law.family and parameter.family == law.family)
                if isinstance(law, Curve) or level.channel == where
            ]
            found = _that_move_as(answer, claim.number, others)[:MOST]
            exact = [other for other in found if _no_motion_tells(answer, claim.number, other)]
            twins = (*claim.twins, *map(str, exact))
            alike = (*claim.alike, *(str(other) for other in found if other not in exact))
            claim = dataclasses.replace(claim, twins=twins, alike=alike)
        claims.append(claim)
    return dataclasses.replace(answer, claims=tuple(claims))


def _no_motion_tells(answer: Answer, number: int, other: ParameterCurve) -> bool:
    """Whether a law does in any motion what a parameter does that follows a channel: a curve can do
    that, or its points do what a spring does at its rest: one that stiffens is no more."""
    search, key = answer.found.search, answer.key
    fitter, fit, law = search.fitter, search.tried[key], search.candidates[number]
    assert isinstance(fitter, SmoothFitter)
    if isinstance(law.effect, Curve):
        return in_any_motion(fitter, search.simulator, law.effect, other)
    there = fit.model.added(fit.theta)[key.index(number)]
    there = there.with_values(**dict.fromkeys(there.strengths(), 0.0))
    return in_any_motion(fitter, search.simulator, other, there)


def _follows_one(law: Effect) -> bool:
    """Whether a law goes by one channel, and is no parameter: a curve by points, or a spring."""
    return isinstance(law, Curve | LinearSpring | CubicSpring) and not isinstance(
        law, ParameterCurve
    )


def _position(simulator: HostSimulator, law: Effect) -> str:
    """The position of the joint that a law acts on, empty of what acts on none."""
    return next((one.position for one in simulator.joints if one.name == law.where), "")


def _that_move_as(
    answer: Answer, number: int, others: Sequence[ParameterCurve]
) -> list[ParameterCurve]:
    """The curves that fit as well in place of a law of the answer."""
    search, key = answer.found.search, answer.key
    fitter, fit = search.fitter, search.tried[key]
    assert isinstance(fitter, SmoothFitter)
    most, law = AS_WELL * fit.merit + fitter.tie(search.nominal), search.candidates[number]
    own = np.flatnonzero(fit.model.owner == key.index(number))[law.linear]
    columns = fit.by_knob[..., own].reshape(-1, len(own))
    does = columns @ fit.theta[own]
    found = []
    for other in others:
        there = moved(fitter, fit, other)
        if not (is_one_of(there, [columns]) or is_one_of(does[:, None], [there])):
            continue
        if any(again.merit <= most for again in _fits_in_place(answer, number, does, other)):
            found.append(other)
    return found


def _fits_in_place(
    answer: Answer, number: int, does: Array, other: ParameterCurve
) -> Iterator[Fit]:
    """Fits with a parameter that follows a channel in place of a law.

    From where it moves as the law does; from the nominal simulator on, since what changes many
    times over leads elsewhere; and through about as many points as a curve has, in two halves.

    Args:
        answer: With the law.
        number: The law.
        does: What that does in the log.
        other: What comes in its place.
    """
    search, key = answer.found.search, answer.key
    fitter, fit = search.fitter, search.tried[key]
    assert isinstance(fitter, SmoothFitter)
    (heir,) = candidates(search.simulator, [other], fitter.samples)
    values: Any = np.linalg.lstsq(moved(fitter, fit, other), does, rcond=1e-10)[0]
    chosen, theta = in_place(search, key, number, heir, values)
    fits = [fitter.fit(Model(search.simulator, chosen), theta, fit)]
    yield fits[0]
    _, theta = in_place(search, key, number, heir, heir.trials[0].values[0])
    fits.append(fitter.fit(Model(search.simulator, chosen), theta, search.nominal))
    yield fits[1]
    yield _fit_in_halves(answer, min(fits, key=lambda one: one.merit), heir, other)


def _fit_in_halves(answer: Answer, fit: Fit, whole: Candidate, curve: ParameterCurve) -> Fit:
    """A fit with two curves, one after the other, in place of one: they make any course through
    five points, and are begun where the one is."""
    search = answer.found.search
    fitter, middle = search.fitter, (curve.low + curve.high) / 2
    assert isinstance(fitter, SmoothFitter)
    halves = [curve.with_values(high=middle), curve.with_values(low=middle)]
    own = fit.model.owner == fit.model.chosen.index(whole)
    there = curve.with_values(**dict(zip(curve.strengths(), fit.theta[own], strict=True)))
    values = there.at(np.linspace(curve.low, curve.high, 5))
    begun = [*values[:3], 0.0, *(values[3:] - values[2])]
    parts: list[Candidate] = []
    theta: list[float] = []
    for place, one in enumerate(fit.model.chosen):
        mine = one is whole
        parts += candidates(search.simulator, halves, fitter.samples) if mine else [one]
        theta += begun if mine else fit.theta[fit.model.owner == place].tolist()
    return fitter.fit(Model(search.simulator, parts), np.array(theta), fit)
