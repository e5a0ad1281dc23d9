"""A lag of the drive and a time constant of what it drives, which may be in each other's place."""

from __future__ import annotations

import itertools

import numpy as np

from residual.gap.search.pool import Key
from residual.gap.search.sets import Search
from sims.effects.actuator import ActuatorLag
from sims.effects.parameter import ParameterChange

#: Loss with both exchanged over that as they are, up to which the motion is the same.
SAME = 1.05
#: Times that the lag is as long as the time constant, from which on it may be the other.
LONGER = 1.5


def swapped(search: Search, key: Key) -> frozenset[int]:
    """Candidates that are a lag and a time of the simulator with each other's size.

    From rest, two lags in a row make one motion whichever comes first. Where the drive would be the
    slower of the two, though the simulator has it without a lag, its lag is as likely the time of
    the simulator.

    Args:
        search: With what was tried.
        key: The chosen set.
    """
    fit, found = search.tried[key], set[int]()
    for lag, time in itertools.permutations(key, 2):
        drive, change = (search.candidates[number].effect for number in (lag, time))
        if not (isinstance(drive, ActuatorLag) and isinstance(change, ParameterChange)):
            continue
        parameter = search.simulator.parameters[change.parameter]
        if parameter.unit != "s":
            continue
        nominal = float(np.mean(parameter.value))
        at, its_at = (np.argmax(fit.model.owner == key.index(number)) for number in (lag, time))
        own, its = fit.theta[at], nominal + fit.theta[its_at]
        if own < LONGER * its:
            continue
        theta = fit.theta.copy()
        theta[at], theta[its_at] = its, own - nominal
        if search.fitter.fit(fit.model, theta, fit).merit <= SAME * fit.merit:
            found |= {lag, time}
    return frozenset(found)
