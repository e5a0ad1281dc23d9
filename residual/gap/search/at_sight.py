"""Rarer effects that stand out beside the library before anything is fitted.

They are looked for in the forecasts, in the linear picture around the nominal simulator, and in the
missing force, of which each effect says what it would be along the path that was measured. Where a
gap is large the nominal simulator's own path is nowhere near that, and the linear picture shows
nothing; where it is small, noise hides it in a force.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.fitting.columns import changes
from residual.gap.fitting.noise import Floor, Noise, driven_states, seen_driven
from residual.gap.fitting.screening import Signatures, gains, pair_gains, signatures, trials
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.model.candidates import Candidate
from residual.gap.model.model import Model
from residual.gap.search.sets import Search

Array = NDArray[np.float64]

#: Part of the cost that the library's best effect may leave without others being looked at, and of
#: what it leaves that one of these leaves at most.
QUARTER = 0.25
#: Part of what one leaves that two leave at most.
HALF = 0.5


def at_sight(search: Search, further: Sequence[Candidate], floor: Noise) -> list[Candidate]:
    """Those that leave a fraction of what the best of the library leaves, alone, or two between the
    same joints.

    Args:
        search: In which nothing is fitted but the nominal simulator.
        further: What is not on offer in it.
        floor: Noise around the nominal simulator, with the missing force.
    """
    fitter, nominal = search.fitter, search.tried[()]
    if not (further and isinstance(fitter, SmoothFitter) and isinstance(floor, Floor)):
        return []

    def in_forecasts(pool: Sequence[Candidate]) -> Signatures:
        return signatures(nominal, trials(pool), fitter.columns(nominal, pool))

    # What a sensor makes of a state is no force.
    acting = [c for c in search.candidates[: search.screened] if c.effect.enters != "sensor"]
    forces = functools.partial(_forces, fitter, floor, nominal.model)
    found = _standing_out(search.signatures(()), further, in_forecasts)
    found |= _standing_out(forces(acting), further, forces)
    return [one for number, one in enumerate(further) if number in found]


def _standing_out(
    own: Signatures, further: Sequence[Candidate], seen: Callable[[Sequence[Candidate]], Signatures]
) -> set[int]:
    """Numbers of those that stand out.

    Args:
        own: Of the library.
        further: Of which some may; ``seen`` tells their signatures.
    """
    cost = float(own.residual @ own.residual)
    left = cost - max((gain.value for gain in gains(own)), default=0.0)
    if left < QUARTER * cost:
        return set()
    others = seen(further)
    alone = dict.fromkeys(range(len(further)), 0.0)
    for gain in gains(others):
        number = others.variants[gain.variants[0]].candidate
        alone[number] = max(alone[number], gain.value)
    found = {number for number, value in alone.items() if cost - value < QUARTER * left}
    for two in of_one_pair(further):
        both = cost - _together(others, two)
        if both < QUARTER * left and both < HALF * (cost - max(alone[n] for n in two)):
            found |= set(two)
    return found


def of_one_pair(pool: Sequence[Candidate]) -> list[tuple[int, int]]:
    """Numbers of two effects between the same two joints: a gyroscope couples its axes both ways,
    a belt is a spring and a damper."""
    pairs = [sorted(one.effect.pair) for one in pool]
    both = itertools.combinations(range(len(pool)), 2)
    return [(a, b) for a, b in both if pairs[a] and pairs[a] == pairs[b]]


def _forces(
    fitter: SmoothFitter, floor: Floor, model: Model, candidates: Sequence[Candidate]
) -> Signatures:
    """The missing accelerations over their noise, and what each candidate would make of them."""
    samples, windows = fitter.samples, fitter.blocks.windows
    seen = seen_driven(model, samples)
    columns = [driven_states(model)[place] for place in seen]
    rows = np.unique(windows.index[windows.inside])
    acts, _ = changes(samples, floor.nodes, floor.slope, model, np.zeros(0), candidates)
    weight = 1.0 / _noise(fitter, floor, model, columns)
    force = floor.force[rows][:, seen] * weight
    made = acts[rows][:, columns] / samples.durations[rows, None, None] * weight[:, None]
    known = np.isfinite(force) & np.isfinite(made).all(axis=2)
    return Signatures(tuple(trials(candidates)), made[known], force[known])


def _noise(fitter: SmoothFitter, floor: Floor, model: Model, columns: Sequence[int]) -> Array:
    """Noise of the acceleration that a difference of readings tells, by driven state."""
    channels = model.simulator.physical_channels
    measured = zip(fitter.samples.measured, floor.sigma, strict=True)
    sigma = {channels[column].name: own for column, own in measured}
    period = float(np.median(fitter.samples.durations))
    found = []
    for channel in (channels[column] for column in columns):
        once = channel.name in sigma  # else its position is measured, and differenced twice
        name = channel.name if once else str(channel.rate_of)
        found.append(sigma[name] / period ** (1 if once else 2))
    return np.array(found)


def _together(found: Signatures, two: tuple[int, int]) -> float:
    """What two candidates take off the cost together."""
    others = {variant.candidate for variant in found.variants} - set(two)
    return max((gain.value for gain in pair_gains(found, 1, without=tuple(others))), default=0.0)
