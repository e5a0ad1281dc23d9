"""The errors on records that were set aside, and never used to find the answer."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from residual.gap.answer.confirmed import Answer
from residual.gap.answer.table import held_out
from residual.gap.confirmation.rest import beginning_as, each_as_it_fits
from residual.gap.data.excerpt import excerpt
from residual.gap.data.samples import in_order
from residual.gap.fitting.forecasts import noise_floor
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.model.model import Model
from residual.gap.preparation.numerics import enough_for, own_substeps, stride_for
from residual.gap.preparation.prepare import Prepared, prepare
from residual.gap.result import Gap
from residual.trajectories import Trajectory


def judged_apart(
    answer: Answer, prepared: Prepared, held: Sequence[Trajectory], table: Gap, rested: bool
) -> Gap:
    """The same table for records that were set aside.

    Args:
        answer: What was found in ``prepared``, whose errors ``table`` holds.
        held: The records, in which no channel is measured that is not in ``prepared``.
        rested: Whether some that were searched began from rest, so that these may have, too.
    """
    search = answer.found.search
    runs, _ = excerpt(held, stride_for(held, prepared.horizon))
    other = prepare(search.simulator, runs, prepared.horizon).fitter
    other = other.weighed_like(search.fitter)
    tried = (search.nominal, search.tried[answer.key])
    nominal, found = (fit.model.bind(fit.theta) for fit in tried)
    if isinstance(other, SmoothFitter):
        # As fine as was searched, and as what was found needs here.
        samples = other.samples
        most = own_substeps(answer.corrected, runs, samples.stride)
        few = enough_for(found, search.simulator, samples, other.nodes, other.sigma, most)
        searched = min(most, search.fitter.samples.substeps)
        other = other.with_substeps(max(few, searched, samples.substeps))
        if rested:
            usual = other.fit(Model(found), np.zeros(0))
            ordered = in_order(runs, samples.stride)
            other = beginning_as(other, each_as_it_fits(other, usual, ordered))
    fits = [other.fit(Model(simulator), np.zeros(0)) for simulator in (nominal, found)]
    sigma = other.samples.of_these(search.fitter.samples, answer.found.floor.sigma)
    floor = noise_floor(other, fits[1], sigma)
    return held_out(table, other, fits[0], fits[1], floor)
