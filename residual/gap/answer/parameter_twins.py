"""Parameters that would do what a curve by points does if they followed a channel.

Some do in any motion: a damping that follows the speed is a friction by speed. Others do as the
log goes: what falls at its final speed is at one speed wherever it is, so that a drag which follows
the height is a force by height.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.answer.confirmed import Answer
from residual.gap.answer.varying import MOST, is_one_of, moved
from residual.gap.data.levels import levels
from residual.gap.fitting.contract import Fit
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.model.candidates import Candidate, candidates
from residual.gap.model.model import Model
from residual.gap.search.continuation import in_place
from sims.effects.aliases import shortly_after
from sims.effects.curve import Curve
from sims.effects.parameter_curve import ParameterCurve

Array = NDArray[np.float64]

#: Loss over that of a law up to which a parameter that follows a channel does the same.
AS_WELL = 1.1
#: States at which motions are compared.
ROWS = 200


def with_parameters_as_twins(answer: Answer, offered: Collection[str]) -> Answer:
    """An answer whose curves by points know the parameters that would do the same if they followed
    a channel: those that do in any motion are twins, as of a curve of the speed a wheelbase that
    grows with it, others are alike in these data.

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
        if isinstance(law, Curve) and not isinstance(law, ParameterCurve) and claim.sure:
            others = [
                ParameterCurve(name, level.channel).suited_to(*level.reach)
                for level in levels(simulator, fitter.samples)
                for name, parameter in simulator.parameters.items()
                if name in offered and not level.of_size
                if not (law.family and parameter.family == law.family)
            ]
            found = _that_move_as(answer, claim.number, law, others)[:MOST]
            exact = [other for other in found if _in_any_motion(answer, law, other)]
            twins = (*claim.twins, *map(str, exact))
            alike = (*claim.alike, *(str(other) for other in found if other not in exact))
            claim = dataclasses.replace(claim, twins=twins, alike=alike)
        claims.append(claim)
    return dataclasses.replace(answer, claims=tuple(claims))


def _that_move_as(
    answer: Answer, number: int, law: Curve, others: Sequence[ParameterCurve]
) -> list[ParameterCurve]:
    """The curves that fit as well in place of a law of the answer."""
    search, key = answer.found.search, answer.key
    fitter, fit = search.fitter, search.tried[key]
    assert isinstance(fitter, SmoothFitter)
    most = AS_WELL * fit.merit + fitter.tie(search.nominal)
    does = moved(fitter, fit, law)
    alike = [other for other in others if is_one_of(moved(fitter, fit, other), [does])]
    return [
        other
        for other in alike
        if any(again.merit <= most for again in _fits_in_place(answer, number, does, other))
    ]


def _in_any_motion(answer: Answer, law: Curve, other: ParameterCurve) -> bool:
    """Whether a law can do what a parameter that follows a channel does wherever each state and
    each input may be: each at values of the log, drawn for itself."""
    fitter, simulator = answer.found.search.fitter, answer.found.search.simulator
    assert isinstance(fitter, SmoothFitter)
    rng, samples = np.random.default_rng(0), fitter.samples
    rows = rng.integers(0, len(samples), ROWS)
    states = rng.permuted(fitter.nodes[rows, : len(simulator.physical_channels)], axis=0)
    inputs = rng.permuted(samples.actions[rows], axis=0)
    plain = simulator.with_effects(())
    scale = np.array([channel.scale for channel in simulator.physical_channels])

    def does(curve: Curve) -> Array:
        columns = []
        for field in curve.strengths():
            small = 1e-3 * curve.quantities(simulator)[field].scale
            ends = [
                shortly_after(plain.with_effects([curve.with_values(**{field: size})]), *drawn)
                for size in (small, -small)
            ]
            columns.append(((ends[0] - ends[1]) / scale).ravel())
        return np.stack(columns, axis=1)

    drawn = states, inputs
    return is_one_of(does(other), [does(law)])


def _fits_in_place(
    answer: Answer, number: int, does: Array, other: ParameterCurve
) -> Iterator[Fit]:
    """Fits with a parameter that follows a channel in place of a law.

    From where it moves as the law does; from the nominal simulator on, since what changes many
    times over leads elsewhere; and through about as many points as the law has, in two halves.

    Args:
        answer: With the law.
        number: The law.
        does: What that does at each of its points, one column each.
        other: What comes in its place.
    """
    search, key = answer.found.search, answer.key
    fitter, fit = search.fitter, search.tried[key]
    assert isinstance(fitter, SmoothFitter)
    own = fit.model.owner == key.index(number)
    (heir,) = candidates(search.simulator, [other], fitter.samples)
    values = np.linalg.lstsq(moved(fitter, fit, other), does @ fit.theta[own], rcond=1e-10)[0]
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
