"""What exact twins of named effects would be, and what the others would be beside them.

Effects that make the same motion in any data each have their own size for it, and what is named
beside them may have another, too: friction counts per unit of inertia, so that it is larger beside
a heavier rotor than beside an arm that is longer.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.confirmation.claim import Claim
from residual.gap.data.samples import Samples
from residual.gap.fitting.contract import Fit
from residual.gap.fitting.plausible import absurd
from residual.gap.model.candidates import Candidate, Knob, candidates
from residual.gap.model.model import Model
from residual.gap.result import Meant
from residual.gap.search.continuation import handed_over, in_place
from residual.gap.search.pool import Key
from residual.gap.search.sets import Search
from sims.effects.base import Effect
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: Twins of each effect that are fitted in its place.
MOST = 4
#: Rise of the loss up to which a twin makes the same motion: beyond, its bounds are in the way.
REACHED = 1.02
#: Part of an interval by which a number differs.
DIFFERS = 0.25


def exact_twins(
    simulator: HostSimulator, samples: Samples, groups: Mapping[str, Sequence[str]],
    offered: Mapping[str, Effect],
) -> dict[str, list[Candidate]]:  # fmt: skip
    """Candidates that move exactly as an effect does, by its label.

    Args:
        simulator: The nominal simulator.
        samples: The measured table.
        groups: Labels of exact twins, by label.
        offered: Effects by label.
    """
    found = {}
    for label in groups:
        others = [name for name in groups[label] if name != label and name in offered]
        found[label] = candidates(simulator, [offered[name] for name in others[:MOST]], samples)
    return found


def with_twins(search: Search, key: Key, claims: Sequence[Claim]) -> tuple[Claim, ...]:
    """The claims with the numbers of their twins, and intervals that hold whichever is meant.

    Of what strikes the ground they stay as they are, since a fit takes long there.

    Args:
        search: With the chosen set.
        key: The chosen set.
        claims: Of its members.
    """
    given = {claim.number: claim for claim in claims}
    told = dict(given)
    twins = [
        (number, twin) for number in told for twin in search.twins_of(number)
        if not search.simulator.has_contacts
    ]  # fmt: skip
    for number, twin in twins:
        fit = _in_place(search, key, number, twin)
        if fit.merit > _reached(search, key):
            continue
        if absurd(fit.model, fit.theta, search.fitter.samples)[1]:
            continue
        rest = [i for i in key if i != number]
        mine = fit.theta[fit.model.owner == len(rest)]
        meant = Meant(twin.label, _units(twin.knobs, mine))
        told[number] = dataclasses.replace(told[number], meant=(*told[number].meant, meant))
        for place, other in enumerate(rest):
            values = fit.theta[fit.model.owner == place]
            own = search.tried[key].model
            knobs = [own.knobs[j] for j in np.flatnonzero(own.owner == key.index(other))]
            told[other] = _beside(told[other], given[other], knobs, values, twin.label)
    return tuple(told.values())


def _in_place(search: Search, key: Key, number: int, twin: Candidate) -> Fit:
    """The set fitted with a twin in place of one of its members, the twin's numbers last."""
    fit = search.tried[key]
    chosen, start = in_place(search, key, number, twin, 0.01 * twin.trials[0].values[0])
    model = Model(search.simulator, chosen)
    found = search.fitter.fit(model, start, fit)
    if found.merit <= _reached(search, key) or not search.candidates[number].linear.all():
        return found
    again = search.fitter.fit(model, handed_over(search, key, number, twin), fit)
    return again if again.merit < found.merit else found


def _reached(search: Search, key: Key) -> float:
    """The largest loss of a set that makes the same motion."""
    return REACHED * search.tried[key].merit + search.fitter.tie(search.nominal)


def _units(knobs: Sequence[Knob], values: Array) -> dict[str, tuple[float, str]]:
    return {
        knob.field: (float(value), knob.unit) for knob, value in zip(knobs, values, strict=True)
    }


def _beside(claim: Claim, before: Claim, knobs: Sequence[Knob], values: Array, twin: str) -> Claim:
    """A claim with the numbers that it has beside a twin of another, where they differ.

    Args:
        claim: What is known so far.
        before: The claim without any twin: its interval goes along in proportion.
        knobs: Its numbers beside the other members of the set.
        values: What they are beside the twin.
        twin: That one's label.
    """
    numbers, differs = dict(claim.numbers), False
    for field, (value, _) in _units(knobs, values).items():
        number, own = numbers[field], before.numbers[field]
        if abs(value - own.value) <= DIFFERS * (own.high - own.low):
            continue
        differs = True
        low, high = own.low + value - own.value, own.high + value - own.value
        if value * own.value > 0:
            low, high = sorted((own.low * value / own.value, own.high * value / own.value))
        knob = next(knob for knob in knobs if knob.field == field)
        numbers[field] = dataclasses.replace(
            number,
            low=max(min(number.low, low), knob.low),
            high=min(max(number.high, high), knob.high),
            if_exact=number.if_exact or (own.low, own.high),
        )
    if not differs:
        return claim
    meant = Meant(twin, _units(knobs, values))
    return dataclasses.replace(claim, numbers=numbers, beside=(*claim.beside, meant))
