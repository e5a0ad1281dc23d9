"""The errors on records that were set aside, and never used to find the answer."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.answer.confirmed import Answer
from residual.gap.answer.table import AS_GOOD_AS_NOISE, forecasts, held_out
from residual.gap.confirmation.rest import beginning_as, each_as_it_fits
from residual.gap.data.excerpt import excerpt
from residual.gap.data.samples import in_order
from residual.gap.fitting.contract import Fitter, Foretold
from residual.gap.fitting.forecasts import noise_floor
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.fitting.validation import by_block
from residual.gap.model.model import Model
from residual.gap.preparation.numerics import enough_for, own_substeps, stride_for
from residual.gap.preparation.prepare import Prepared, prepare
from residual.gap.result import Gap
from residual.gap.search.pool import Key, all_but
from residual.gap.search.sets import Search
from residual.trajectories import Trajectory
from sims.effects.store import SecondStore

Array = NDArray[np.float64]

#: Part of what an effect takes off where it was found that it has to take off elsewhere.
AS_WELL = 0.25
#: What is to be said of a hidden store where such records have larger errors than they may have.
FILLED = (
    "a second store is taken to be in balance where a record begins: of records set aside that "
    "begin amid a change, as the tail of one that was cut in two does, the errors are too large; "
    "set whole records aside"
)


@dataclasses.dataclass(frozen=True)
class Apart:
    """What records that were set aside say.

    Attributes:
        table: Their errors; None without such records.
        refuted: Whether the corrected simulator is worse on them.
        helpless: Otherwise, the effects that do not help there, though they could.
        says: What is to be known of that.
    """

    table: Gap | None
    refuted: bool
    helpless: frozenset[int]
    says: tuple[str, ...] = ()


#: Nothing was set aside.
NOT_JUDGED = Apart(None, False, frozenset())


def judged_apart(
    answer: Answer, prepared: Prepared, held: Sequence[Trajectory], table: Gap, rested: bool
) -> Apart:
    """The same table for records that were set aside, and what it says against effects.

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
    judged = held_out(table, other, fits[0], fits[1], floor)
    if judged.refutes:
        hidden = any(isinstance(e, SecondStore) for e in answer.corrected.effects)
        return Apart(judged, True, frozenset(), (FILLED,) if hidden else ())
    shown = forecasts(other, fits[1])
    useless = (
        number
        for number in answer.key
        if _useless(search, answer.key, number, other, shown, floor, judged.denies)
    )
    return Apart(judged, False, frozenset(useless))


def _useless(
    search: Search,
    key: Key,
    number: int,
    other: Fitter,
    found: Foretold,
    floor: Array,
    denied: bool,
) -> bool:
    """Whether an effect does not take off a quarter of what it took off where it was found, at the
    channel that it helped most there, though it could.

    It could if more than noise is left of that, and it moves forecasts by so much: a gain on an
    input that is zero does not. Where nothing helps, it could if it moves them by more than noise.

    Args:
        search: With the chosen set, and that without the effect.
        key: The chosen set.
        number: The effect.
        other: For the records set aside.
        found: What the corrected simulator forecasts there.
        floor: See ``noise_floor``, of these records.
        denied: Whether all effects together help nothing there.
    """
    rest = all_but(key, number)
    if rest not in search.validated:
        return denied
    took = 1 - _mean(search.validated[key].squares) / _mean(search.validated[rest].squares)
    took = other.samples.of_these(search.fitter.samples, took)
    place = int(np.argmax(took))
    fit = search.tried[rest]
    without = forecasts(other, other.fit(Model(fit.model.bind(fit.theta)), np.zeros(0)))
    own, lacking = (_mean(by_block(one.squares, other.blocks))[place] for one in (found, without))
    apart = (found.shown - without.shown)[other.blocks.windows.inside][:, place]
    moved, least = float((apart**2).mean()), AS_WELL * max(took[place], 0.0)
    if denied and moved > _mean(floor)[place]:
        return True
    if moved < least * (moved + own):
        return False
    if denied:
        return True
    if took[place] <= 0 or not own > AS_GOOD_AS_NOISE * _mean(floor)[place]:
        return False
    return bool(1 - own / lacking < least)


def _mean(squares: Array) -> Array:
    """Mean over blocks by channel, (B, m) -> (m,)."""
    return np.maximum(np.nanmean(squares, axis=0), 1e-300)
