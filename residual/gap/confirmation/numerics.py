"""What was found under other numerics: finer steps, and inputs held the other way."""

from __future__ import annotations

import copy
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.lost_rows import untimed_changes
from residual.gap.data.samples import Samples
from residual.gap.fitting.contract import Fit
from residual.gap.fitting.validation import validate
from residual.gap.model.model import Model
from residual.gap.preparation.numerics import FINE, held_otherwise
from residual.gap.search.pool import Key
from residual.gap.search.sets import Search
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: Part of the misfit that another way to read the log, such as the other hold, must take off to be
#: believed.
CLEARER = 0.05
#: Part of the windows in which changes of inputs have to be timed to leave out the others.
TIMED = 0.3
#: Sub-steps of a corrected simulator, at most, over the nominal one's.
FINEST = 32
#: How far a number may lie off, in a fold or with other numerics, as a share of it.
STEADY = 0.5


def with_enough_substeps(corrected: HostSimulator, search: Search, key: Key) -> HostSimulator:
    """A corrected simulator with so many sub-steps that it moves as with twice as many.

    What was found may be faster than anything in the nominal simulator: a time constant of a
    quarter of the nominal one is unstable where that was fine. The step of a model that came from
    a file of its own, and of one that strikes the ground, is its author's.

    Args:
        corrected: With effects whose values are numbers.
        search: With the set that it is made of.
        key: That set.
    """
    own = not corrected.has_contacts and not corrected.own_files()
    if not (own and key and corrected.advances_rows_at_once):
        return corrected
    samples, fitter = search.fitter.samples, search.fitter
    rows = np.unique(np.linspace(0, len(samples) - 1, min(len(samples), 400)).astype(int))
    physical = len(corrected.physical_channels)
    actions = samples.actions[rows]
    states = corrected.augment(search.tried[key].inner.nodes[rows][:, :physical], actions)

    def after(simulator: HostSimulator) -> Array:
        return simulator.step(states, actions)[:, samples.measured]

    now, coarse = corrected, after(corrected)
    while now.substeps < FINEST * corrected.substeps:
        finer = copy.copy(now)
        finer.substeps = 2 * now.substeps
        fine = after(finer)
        if (np.quantile(np.abs(fine - coarse), 0.95, axis=0) <= FINE * fitter.sigma).all():
            break
        now, coarse = finer, fine
    return now


def fits_better(search: Search, key: Key, other: HostSimulator) -> bool:
    """Whether the chosen set fits clearly better on a simulator with inputs held otherwise."""
    fitter, fit = search.fitter, search.tried[key]
    again = fitter.fit(Model(other, fit.model.chosen), fit.theta)
    timed = _timed(search)
    gained = (fit.loss - again.loss)[timed].sum()
    return bool(gained > max(CLEARER * fit.loss[timed].sum(), fitter.tie(search.tried[()])))


def _timed(search: Search) -> NDArray[np.bool_]:
    """Windows that tell how inputs are held, (W,): those in which all changes of them are timed, if
    these are enough."""
    fitter = search.fitter
    timed = ~untimed_changes(fitter.samples, fitter.blocks.windows)
    return timed if timed.mean() > TIMED else np.ones(len(timed), bool)


def forecast_error(search: Search, key: Key) -> float:
    """Cross-validated squared forecast error of a set, see ``in_spreads``."""
    return in_spreads(search.fitter.samples, search.validated[key].squares)


def times_better(search: Search, key: Key) -> float:
    """Times that forecasts with a set are better than those of the nominal simulator."""
    nominal = forecast_error(search, ()) if () in search.validated else np.inf
    return float(np.sqrt(nominal / max(forecast_error(search, key), 1e-300)))


def in_spreads(samples: Samples, squares: Array) -> float:
    """Squared errors (B, m) in units of the spread of each channel, all averaged."""
    spread = np.nanvar(samples.seen[:, samples.measured], axis=0)
    return float(np.nanmean(squares / np.maximum(spread, 1e-300)))


def by_profile(search: Search, key: Key) -> None:
    """Give a set the numbers and the spread that the profile of the loss tells, where fits hang on
    luck in finding start states."""
    fit = search.fitter.profiled(search.tried[key])
    if fit is not search.tried[key]:
        search.tried[key], search.validated[key] = fit, validate(search.fitter, fit)


def at_half_step(search: Search, key: Key) -> Fit:
    """A set fitted at half the integration step."""
    if key not in search.halved:
        fit = search.tried[key]
        search.halved[key] = search.fitter.halved().fit(fit.model, fit.theta, fit)
    return search.halved[key]


def other_numerics(search: Search, key: Key, tie: float) -> list[Array]:
    """Numbers of a set fitted at half the step, and with inputs held the other way, each (p,).

    Where the data say clearly how inputs are held, the other hold is no question.

    Args:
        search: With the fitted set.
        key: The set.
        tie: Rise of the loss beyond which the other hold is out.
    """
    fitter, fit = search.fitter, search.tried[key]
    found = [at_half_step(search, key).theta]
    flipped = held_otherwise(search.simulator)
    if flipped is not None:
        other = fitter.fit(Model(flipped, fit.model.chosen), fit.theta)
        if (other.loss - fit.loss)[_timed(search)].sum() < tie:
            found.append(other.theta)
    return found


def in_the_limit(theta: Array, numerics: Sequence[Array]) -> list[Array]:
    """Numbers where the step goes to zero, and with the other hold, each (p,).

    What half the step changes is doubled: an integrator of first order has as much again to go, so
    that a number which only makes up for its error, and is half as large at half the step, ends
    at zero (Richardson's extrapolation).
    """
    return [2 * numerics[0] - theta, *numerics[1:]] if len(numerics) else []


def survives(value: float, half: float, others: Sequence[float], least: float = 0.0) -> bool:
    """Whether a number keeps its sign and about its size under other numerics."""
    slack = max(STEADY * max(abs(value), least), half)
    return all(abs(other - value) <= slack for other in others)
