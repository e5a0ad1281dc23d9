"""A lag of the drive and a time constant of what it drives, which may be in each other's place."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from residual.gap.confirmation.claim import Claim
from residual.gap.search.sets import Key, Search
from sims.effects.actuator import ActuatorLag
from sims.effects.parameter import ParameterChange

#: Loss with both exchanged over that as they are, up to which the motion is the same.
SAME = 1.05
#: Times that the lag is as long as the time constant, from which on it may be the other.
LONGER = 1.5


def swapped(search: Search, key: Key, claims: Sequence[Claim]) -> frozenset[int]:
    """Candidates that are a lag and a time of the simulator with each other's size.

    From rest, two lags in a row make one motion whichever comes first. Where the drive would be the
    slower of the two, though the simulator has it without a lag, its lag is as likely the time of
    the simulator.

    Args:
        search: With what was tried.
        key: The chosen set.
        claims: Of its members.
    """
    fit, found = search.tried[key], set[int]()
    numbers = {claim.number: np.flatnonzero(fit.model.owner == key.index(claim.number))
               for claim in claims}  # fmt: skip
    for lag, time in itertools.permutations(numbers, 2):
        drive, change = (search.candidates[number].effect for number in (lag, time))
        if not (isinstance(drive, ActuatorLag) and isinstance(change, ParameterChange)):
            continue
        if search.simulator.parameters[change.parameter].unit != "s":
            continue
        nominal = float(np.mean(search.simulator.parameters[change.parameter].value))
        own, its = fit.theta[numbers[lag][0]], nominal + fit.theta[numbers[time][0]]
        if own < LONGER * its:
            continue
        theta = fit.theta.copy()
        theta[numbers[lag][0]], theta[numbers[time][0]] = its, own - nominal
        if search.fitter.fit(fit.model, theta, fit).merit <= SAME * fit.merit:
            found |= {lag, time}
    return frozenset(found)
