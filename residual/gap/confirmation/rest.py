"""Records that begin with a step: what delays and lags remember of the time before them.

A log says nothing of the input before its first sample. Mostly that was the first one, or the log
would begin earlier; but a step test is often logged from the step on, and begins from rest.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.confirmation.numerics import CLEARER
from residual.gap.data.at_rest import begins_on, rest
from residual.gap.data.samples import in_order
from residual.gap.fitting.contract import Fit
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.search.sets import Key, Search
from residual.trajectories import Trajectory
from sims.effects.actuator import ActuatorLag, Delay
from sims.host import HostSimulator

Array = NDArray[np.float64]


def from_rest(simulator: HostSimulator, runs: Sequence[Trajectory]) -> list[Trajectory]:
    """The runs, those that begin while an input is on taken to have begun from rest."""
    still, on = rest(simulator), begins_on(simulator, runs)
    return [
        dataclasses.replace(run, before=still) if begins else run
        for run, begins in zip(runs, on, strict=True)
    ]


def fits_better_from_rest(
    search: Search, key: Key, runs: Sequence[Trajectory]
) -> list[Trajectory] | None:
    """The runs, those taken to have begun from rest that fit clearly better so, with what was found
    and a lag of every input; None if none does.

    Args:
        search: Fitted sets.
        key: What was chosen.
        runs: What was searched.
    """
    fitter = search.fitter
    if not isinstance(fitter, SmoothFitter) or any(run.before is not None for run in runs):
        return None
    ordered = in_order(runs, fitter.samples.stride)
    if all(run.before is None for run in from_rest(search.simulator, ordered)):
        return None
    lagging = _with_lags(search, key)
    if lagging is None:
        return None
    model, theta = search.model(lagging[0]), lagging[1]
    usual = fitter.fit(model, theta, search.tried[key])
    chosen = each_as_it_fits(fitter, usual, ordered)
    if all(run.before is None for run in chosen):
        return None
    least = min(usual.merit, search.tried[key].merit)
    needed = max(CLEARER * least, fitter.tie(search.tried[()]))
    begun = beginning_as(fitter, chosen).fit(model, theta, search.tried[key])
    return chosen if least - begun.merit > needed else None


def each_as_it_fits(
    fitter: SmoothFitter, usual: Fit, ordered: Sequence[Trajectory]
) -> list[Trajectory]:
    """The runs, those taken to have begun from rest that fit better so.

    Args:
        fitter: Holds the runs, and ``usual``, its fit with the first input as what came before.
        ordered: The runs in the order of the fitter.
    """
    rested = from_rest(usual.model.simulator, ordered)
    if all(run.before is None for run in rested):
        return rested
    begun = beginning_as(fitter, rested).fit(usual.model, usual.theta, usual)
    run = fitter.blocks.windows.run
    gained = np.bincount(run, usual.loss - begun.loss, minlength=len(ordered))
    return [
        late if won > 0 else run for late, run, won in zip(rested, ordered, gained, strict=True)
    ]


def beginning_as(fitter: SmoothFitter, ordered: Sequence[Trajectory]) -> SmoothFitter:
    """The fitter with what came before each run as these runs have it."""
    recorded = tuple(
        dataclasses.replace(one, before=run.before)
        for one, run in zip(fitter.samples.recorded, ordered, strict=True)
    )
    return dataclasses.replace(
        fitter, samples=dataclasses.replace(fitter.samples, recorded=recorded)
    )


def _with_lags(search: Search, key: Key) -> tuple[Key, Array] | None:
    """A set with a lag at every input that it leaves without memory, or a delay where lags are not
    asked for, and where its fit begins; None if it holds none then."""
    chosen = [search.candidates[number].effect for number in key]
    remembers = {e.where for e in chosen if isinstance(e, ActuatorLag | Delay)}
    more: dict[str, tuple[int, Array]] = {}
    for kind in (ActuatorLag, Delay):
        for number, candidate in enumerate(search.candidates[: search.screened]):
            where = candidate.effect.where
            if isinstance(candidate.effect, kind) and where not in remembers:
                more.setdefault(where, (number, candidate.trials[0].values[0]))
    return search.merged(key, list(more.values())) if more or remembers else None
