"""Single effects that were not offered and that a chosen pair imitates."""

from __future__ import annotations

import numpy as np

from residual.gap.fitting.screening import gains, signatures, trials
from residual.gap.model.candidates import candidates
from residual.gap.model.model import Model
from residual.gap.search.pool import Key
from residual.gap.search.sets import Search
from residual.gap.search.significance import score, size
from sims.effects.combinations import near_combinations
from sims.effects.library import library


def imitated(search: Search, key: Key) -> tuple[str, ...]:
    """Effects of the whole library that alone do as well as a chosen pair.

    Only such that the pair imitates by the simulator's own equations, so that nothing is looked
    for that was ruled out: what would be named is named, with the doubt.

    Args:
        search: With the chosen pair, which leaves no more than noise.
        key: The pair.
    """
    simulator, fitter = search.simulator, search.fitter
    offered = {candidate.label for candidate in search.candidates}
    near = near_combinations(simulator, search.labels(key))
    fresh = [e for e in library(simulator) if str(e) in near and str(e) not in offered]
    nominal = search.tried[()]
    told = []
    for candidate in candidates(simulator, fresh, fitter.samples):
        columns = fitter.columns(nominal, [candidate])
        (start,) = gains(signatures(nominal, trials([candidate]), columns))[0].values
        single = fitter.fit(Model(simulator, [candidate]), start, nominal)
        price = np.log(size(search)) * len(single.theta)
        if single.merit + price - score(search, key) < fitter.tie(nominal):
            told.append(candidate.label)
    return tuple(told)
