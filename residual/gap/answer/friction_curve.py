"""Laws of friction that only imitate the true one: when to ask for the curve itself.

Two laws of the library together, or one over the few speeds of a log, come near any friction. What
they leave is then the same at the same speed, and a curve of three sizes takes most of it off.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from residual.gap.answer.answer import Answer
from residual.gap.answer.free_parameters import better
from residual.gap.fitting.forecasts import noise_floor
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.search.explain import FOOTNOTE
from sims.effects.friction_curve import FrictionCurve
from sims.effects.joint import JointEffect

#: Part of the squared forecast error of the library's laws, less what noise makes, that a curve may
#: leave.
QUARTER = 0.25
#: Part of the speeds of a log below which the fastest lies, where rates are differences of places.
FASTEST = 0.99


def worth_a_curve(answer: Answer, offered: Collection[str]) -> list[FrictionCurve]:
    """A curve for every joint where friction was found, if more than noise is left.

    Args:
        answer: What was found with the effects on offer.
        offered: Their labels. Where a user leaves a law out that is a case of the curve, the curve
            is left out as well.
    """
    search, key = answer.found.search, answer.key
    fitter, simulator = search.fitter, search.simulator
    left = fitter.left(search.tried[key], answer.found.floor)
    if left.adequate or left.ratio <= FOOTNOTE or not isinstance(fitter, SmoothFitter):
        return []
    # A simulator's own damping moves like friction at its joint.
    alike = [one.effect for number in key for one in search.twins_of(number)]
    chosen = [search.candidates[number].effect for number in key]
    rubbed = {
        effect.where
        for effect in (*chosen, *alike)
        if isinstance(effect, JointEffect) and effect.family == FrictionCurve.family
    }
    names = [channel.name for channel in simulator.physical_channels]
    found = []
    for joint in simulator.joints:
        cases = {f"{name}@{joint.name}" for name in FrictionCurve.special_cases}
        if joint.name in rubbed and joint.rate is not None and cases <= set(offered):
            column = names.index(joint.rate)
            measured = column in fitter.samples.measured
            speeds = np.abs(fitter.nodes[:, column])
            full = float(np.quantile(speeds, 1.0 if measured else FASTEST))
            if full > 0:
                found.append(FrictionCurve(joint.name, full=float(f"{full:.3g}")))
    return found


def takes_its_place(second: Answer, first: Answer) -> bool:
    """Whether a curve was named and takes most of what the library's laws left beside noise.

    Args:
        second: What was found with the library and curves; ``first``: without them.
    """
    chosen = [second.found.search.candidates[number].effect for number in second.key]
    if not any(isinstance(effect, FrictionCurve) for effect in chosen):
        return False
    search, again = first.found.search, second.found.search
    by_noise = noise_floor(search.fitter, search.tried[first.key], first.found.floor.sigma)
    before, after, least = (
        search.currency.error(squares) ** 2
        for squares in (
            search.validated[first.key].squares,
            again.validated[second.key].squares,
            by_noise,
        )
    )
    return after - least < QUARTER * (before - least) and better(second, first)
