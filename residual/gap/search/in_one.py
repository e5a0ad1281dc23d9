"""One loss in place of several members of a set that together make it.

Heat that a tank loses to a room is, beside a jacket, a stronger exchange and a weaker jacket: two
numbers off by just as much as one law explains. Where the gap has both, one number is enough.
"""

from __future__ import annotations

import itertools

from residual.gap.search.pool import Key
from residual.gap.search.sets import Search
from sims.effects.actuator import ActuatorGain
from sims.effects.combinations import made_by
from sims.effects.joint import ConstantLoad
from sims.effects.loss import ProportionalLoss
from sims.effects.parameter import ParameterChange

#: Effects that may make a loss together.
MAKE_IT = (ParameterChange, ActuatorGain, ConstantLoad)


def add_in_one(search: Search, key: Key) -> None:
    """Fit sets in which one loss stands for two members of a set, or for three.

    Args:
        search: What is tried goes there.
        key: A fitted set.
    """
    members = [n for n in key if isinstance(search.candidates[n].effect, MAKE_IT)]
    losses = [
        number
        for number in range(search.screened, len(search.candidates))
        if isinstance(search.candidates[number].effect, ProportionalLoss)
    ]
    if len(members) < 2 or not losses:
        return
    together = made_by(search.simulator, search.labels(tuple(members)))
    for loss in losses:
        if loss in key or search.candidates[loss].label not in together:
            continue
        start = 0.01 * search.candidates[loss].trials[0].values[0]
        for count in (2, 3):
            for gone in itertools.combinations(members, count):
                fresh, theta = search.merged(key, [(loss, start)], drop=gone)
                search.add({fresh: theta})
