"""Records that begin with a step: what delays and lags remember of the time before them.

A log says nothing of the input before its first sample. Mostly that was the first one, or the log
would begin earlier; but a step test is often logged from the step on, and begins from rest.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.confirmation.numerics import CLEARER
from residual.gap.data.at_rest import begins_on, rest
from residual.gap.data.samples import in_order
from residual.gap.fitting.contract import Fit
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.search.pool import Key
from residual.gap.search.sets import Search
from residual.trajectories import Trajectory
from sims.effects.actuator import ActuatorGain, ActuatorLag, Delay
from sims.effects.parameter import ParameterChange
from sims.effects.slew import SlewLimit
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: Gains and parameters that are tried beside lags.
STRENGTHS = 6


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
    and a lag of every input, or with lags in place of its delays, or the other way round; None if
    none does.

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
    least, best = search.tried[key].merit, None
    for wider, theta in _with_lags(search, key):
        model = search.model(wider)
        usual = fitter.fit(model, theta, search.tried[key])
        least = min(least, usual.merit)
        chosen = each_as_it_fits(fitter, usual, ordered)
        if any(run.before is not None for run in chosen):
            begun = beginning_as(fitter, chosen).fit(model, theta, search.tried[key]).merit
            best = (begun, chosen) if best is None or begun < best[0] else best
    needed = max(CLEARER * least, fitter.tie(search.tried[()]))
    return best[1] if best and least - best[0] > needed else None


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


def _with_lags(search: Search, key: Key) -> Iterator[tuple[Key, Array]]:
    """A set with a lag at every input that it leaves without memory, or a delay where lags are not
    asked for, and where its fit begins; the same with lags in place of delays, and the other way
    round; none if there are neither. Then lags beside one gain or parameter, whatever was found:
    taken to have gone on before, a step from rest leads to other names."""
    chosen = {number: search.candidates[number].effect for number in key}
    remember = {n: e for n, e in chosen.items() if isinstance(e, ActuatorLag | Delay | SlewLimit)}
    screened = list(enumerate(search.candidates[: search.screened]))
    for dropped in [(), tuple(remember)] if remember else [()]:
        gone = {(type(chosen[n]), chosen[n].where) for n in dropped}
        kept = {e.where for n, e in remember.items() if n not in dropped}
        more: dict[str, tuple[int, Array]] = {}
        for kind in (ActuatorLag, Delay):
            for number, one in screened:
                where = one.effect.where
                if isinstance(one.effect, kind) and where not in kept and (kind, where) not in gone:
                    more.setdefault(where, (number, one.trials[0].values[0]))
        if more or (remember and not dropped):
            yield search.merged(key, list(more.values()), drop=dropped)
    lags = [(n, one) for n, one in screened if isinstance(one.effect, ActuatorLag)]
    strengths = [
        (n, 0.01 * one.trials[0].values[0])
        for n, one in screened
        if isinstance(one.effect, ActuatorGain | ParameterChange)
    ]
    for strength in strengths[:STRENGTHS] if lags else ():
        lagging = [(n, one.trials[0].values[0]) for n, one in lags]
        yield search.merged((), [*lagging, strength])
