"""From a fitter to the effects that explain what it holds: search, weigh anew, choose."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import time
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.fitting.contract import Fit, Fitter, Left
from residual.gap.fitting.forecasts import noise_floor
from residual.gap.fitting.noise import Noise
from residual.gap.model.candidates import Candidate
from residual.gap.preparation.effort import Effort
from residual.gap.search.at_sight import at_sight
from residual.gap.search.beam import extend, improves, run
from residual.gap.search.choice import Choice, choose
from residual.gap.search.continuation import add_handed_over
from residual.gap.search.earlier import (
    HELPS_MUCH,
    add_what_it_lacked,
    carried,
    is_in_vain,
    near_best,
    worth_another_look,
)
from residual.gap.search.exchange import add_exchanged, add_pairs_exchanged, as_good_splits
from residual.gap.search.for_all import add_one_for_all
from residual.gap.search.pairs import every_two
from residual.gap.search.pool import Key, Twins
from residual.gap.search.reasons import reasons
from residual.gap.search.redundant import curves_in_place
from residual.gap.search.sets import Proposals, Search
from residual.gap.search.significance import score, significant
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: Residual over noise below which a remainder is a footnote.
FOOTNOTE = 1.1
#: Residual over noise from which on laws may only imitate the true one.
NOTABLE = 1.5
#: Forecast error over that by noise below which residuals are believed.
WELL = 1.5
#: Times that channels are weighed anew by what the best set leaves of them.
ROUNDS = 3
#: Change of a weight that is worth another search, and where a search takes long.
WORTH, WORTH_LONG = 1.3, 1.6
#: Effects tried in place of each chosen one, and rounds of that.
RIVALS, EXCHANGES = 10, 3
#: Effects tried in place of each at the least.
LEAST = 2
#: Sets that are weighed anew where there is no time to search again.
LAST = 4
#: Seconds of processor time for trying those when the time for searching is over, or part of that.
WEIGHED, AS_LONG = 60.0, 1.0

#: From the fitter that made a fit, and the fit: the fitter whose channels are weighed by what that
#: leaves of them, and the noise around it.
Weighing = Callable[[Fitter, Fit], tuple[Fitter, Noise]]


@dataclasses.dataclass(frozen=True)
class Explanation:
    """What was chosen, and on what grounds.

    Attributes:
        search: All that was tried, in the final weights.
        choice: The chosen set, reasons for the others, what is minor.
        left: What it leaves.
        nominal_left: What the nominal simulator leaves.
        floor: Noise around the chosen set.
        needed: Fall of the cost that earns a name where only noise is left; infinite elsewhere.
        floors: What was worked out by ``by_noise``.
    """

    search: Search
    choice: Choice
    left: Left
    nominal_left: Left
    floor: Noise
    needed: float
    floors: dict[Key, Array] = dataclasses.field(default_factory=dict, repr=False)

    def by_noise(self, key: Key) -> Array:
        """Mean squared errors of blocks if a set of effects were the truth, see ``noise_floor``."""
        if key not in self.floors:
            self.floors[key] = noise_floor(
                self.search.fitter, self.search.tried[key], self.floor.sigma
            )
        return self.floors[key]

    @property
    def key(self) -> Key:
        """The chosen set."""
        return self.choice.key

    @property
    def adequate(self) -> bool:
        """Whether chance decided."""
        return bool(np.isfinite(self.needed))


def explain(
    simulator: HostSimulator,
    pool: Sequence[Candidate],
    fitter: Fitter,
    floor: Noise,
    weigh: Weighing,
    effort: Effort,
    tell: Callable[[str], None],
    until: float,
    beside: Sequence[Candidate] = (),
    earlier: Search | None = None,
    twins: Twins | None = None,
    every_pair: bool = True,
    further: Sequence[Candidate] = (),
) -> Explanation:
    """Search, weigh the channels by what is left, search again, until nothing changes.

    Args:
        simulator: The nominal simulator.
        pool: What may be missing.
        fitter: Channels weighed by what the nominal simulator leaves.
        floor: Noise around it.
        weigh: Weighs the channels anew.
        effort: How hard to search.
        tell: Progress.
        until: When to stop searching, on the clock of ``time.process_time``.
        beside: Free beside every set, see ``Search``.
        earlier: A search without these, or without some of the pool; its best sets are tried, too,
            so that none of them loses for not being asked, and what it lacked beside them.
        twins: Exact twins of what may be missing, by label.
        every_pair: Whether every two effects are tried where there are few.
        further: What is on offer, too, if it stands out, see ``at_sight``.
    """

    def begun(fitter: Fitter, floor: Noise, before: Search | None) -> Search:
        search = Search(
            simulator, pool, fitter, effort, tell, until, beside, twins, floor.sigma, weigh_until
        )
        if len(search.currency.groups) > 1 and not simulator.has_contacts:
            alone = noise_floor(fitter, search.nominal, floor.sigma)
            search.currency = search.currency.only_where_wrong(alone)
        if before is not None:
            search.globally.after(before.globally)
        return search

    # Later searches are given up where they cannot be weighed in time.
    weighing = max(WEIGHED, AS_LONG * (until - time.process_time()))
    weigh_until = until + weighing if earlier is None else np.inf
    seeds: Proposals = {}
    before = earlier
    for _ in range(ROUNDS):
        search = begun(fitter, floor, before)
        if further and before is None and (standing_out := at_sight(search.measured_path, further)):
            pool = [*pool, *standing_out]
            search = begun(fitter, floor, before)
        if not seeds:
            if earlier is not None:
                search.add(carried(earlier, search))
                add_what_it_lacked(earlier, search)
            search.add(curves_in_place(search, near_best(search)))
            if earlier is not None and is_in_vain(earlier, search):
                # What is small does not show where the nominal simulator's error is the measure.
                seeds = {key: search.own(key) for key in worth_another_look(earlier, search)}
                finer, around = weigh(fitter, search.tried[near_best(search)[0]])
                closer = begun(finer, around, search)
                closer.add(seeds)
                if is_in_vain(earlier, closer, HELPS_MUCH):
                    return settle(search, floor, exchanges=0)
                fitter, floor, search = finer, around, closer
        run(search, seeds, functools.partial(_quiet, search, floor))
        in_pairs = every_pair and not (seeds or simulator.has_contacts)
        if in_pairs and not _quiet(search, floor, search.best()):
            every_two(search)
        best = near_best(search)
        fresh, floor = weigh(fitter, search.tried[best[0]])
        ratio, worth = fresh.sigma / fitter.sigma, WORTH_LONG if simulator.has_contacts else WORTH
        alike = (ratio > 1 / worth).all() and (ratio < worth).all()
        if alike and fresh.samples.substeps <= fitter.samples.substeps:
            break
        seeds = {key: search.own(key) for key in best if key}
        if search.late:
            # No time for another search, but for what was found in the weights that it earns.
            search = begun(fresh, floor, search)
            search.add(dict(itertools.islice(seeds.items(), LAST)))
            break
        fitter, before = fresh, search
    return settle(search, floor, earlier is not None)


def settle(
    search: Search, floor: Noise, again: bool = False, exchanges: int = EXCHANGES
) -> Explanation:
    """The final choice, after everything chosen has met its rivals.

    Args:
        search: With all that was tried.
        floor: Noise around the best of it.
        again: Whether, though time is over, what is chosen in place of a first choice meets its
            rivals, too: a later search may come to what it is made for at the end.
        exchanges: Rounds of that, at most; none where nothing new is to be chosen.
    """
    fitter = search.fitter
    nominal_left = fitter.left(search.nominal, floor)
    needed = np.inf

    def enough(key: Key) -> bool:
        return fitter.left(search.tried[key], floor).ratio < FOOTNOTE and forecasts_well(
            search, floor, key
        )

    choice = choose(search, enough)
    for turn in range(exchanges):
        likeliest = min(search.usable(), key=lambda k: score(search, k))
        best = {(), choice.key, search.best(), likeliest}
        quiet = [k for k in best if _quiet(search, floor, k)]
        if quiet:
            needed = fitter.needed(functools.partial(search.signatures, ()), search.tried[()])
            key = significant(search, needed)
            choice = Choice(key, reasons(search, key))
        else:
            needed = np.inf
            choice = choose(search, enough)
            key = choice.key
        before = len(search.tried)
        most = LEAST if search.late else max(LEAST, RIVALS // max(len(key), 1))
        reached = search.error(search.best())
        add_exchanged(search, key, most)
        if not (quiet or search.simulator.has_contacts or search.out_of_time):
            instead = add_one_for_all(search, key)
            again |= choose(search, enough).key in instead
        if not quiet and improves(search, search.best(), reached):
            extend(search, search.best())
        for rival in [] if quiet or search.late else as_good_splits(search, key):
            extend(search, rival)
        if not (search.simulator.has_contacts or search.late):
            add_handed_over(search, key)
            if not quiet:
                add_pairs_exchanged(search, key)
        if len(search.tried) == before or (search.late and (turn or not again)):
            break
        if not quiet and choose(search, enough).key == key:
            break
    left = fitter.left(search.tried[choice.key], floor)
    return Explanation(search, choice, left, nominal_left, floor, needed)


def forecasts_well(search: Search, floor: Noise, key: Key) -> bool:
    """Whether forecasts err by little more than noise makes of them.

    Residuals are a mean over all samples, so that a long rest hides what a short motion leaves.
    """
    alone = noise_floor(search.fitter, search.tried[key], floor.sigma)
    squares = search.validated[key].squares
    times = np.nanmean(squares, axis=0) / np.maximum(np.nanmean(alone, axis=0), 1e-300)
    return bool((times < WELL**2).all())


def _quiet(search: Search, floor: Noise, key: Key) -> bool:
    return search.fitter.left(search.tried[key], floor).adequate
