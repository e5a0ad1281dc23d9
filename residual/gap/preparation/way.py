"""How far the nominal simulator's forecasts are off as a log may count, whatever was fitted."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.model import paths
from residual.gap.model.model import Model
from residual.gap.preparation.convention import Convention
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: Windows that are looked at: all rows at once, and row by row.
AT_ONCE, BY_ROW = 120, 20
#: Error of a window in units of the usual way beyond which it is just wrong.
WRONG = 5.0


def mean_error(
    simulator: HostSimulator, fitter: SmoothFitter, convention: Convention, sizes: int | None = None
) -> float:
    """Mean error of forecasts straight from what was measured, in units of the usual way; see
    ``errors_of``. A window that is just wrong counts no more than that."""
    return float(np.minimum(errors_of(simulator, fitter, convention, sizes), WRONG).mean())


def errors_of(
    simulator: HostSimulator, fitter: SmoothFitter, convention: Convention, sizes: int | None = None
) -> Array:
    """Errors of some windows' forecasts straight from what was measured, in units of the usual way.

    Args:
        simulator: The nominal simulator.
        fitter: With the windows to forecast.
        convention: How columns may count.
        sizes: Place of a state of which the log may hold the size alone: every window begins with
            the sign that does better.
    """
    samples, windows = fitter.samples, fitter.blocks.windows
    acting, clock = convention.inputs_of, convention.clock
    samples = dataclasses.replace(
        samples, seen=convention.states_of(samples.seen),
        actions=acting(samples.actions), durations=clock * samples.durations,
        times=clock * samples.times,
        recorded=tuple(
            dataclasses.replace(
                run, actions=acting(run.actions), durations=clock * run.durations,
                before=None if run.before is None else acting(run.before),
            )
            for run in samples.recorded
        ),
    )  # fmt: skip
    model, none = Model(simulator), np.zeros((1, 0))
    nodes = paths.measured(model, samples, none[0])
    most = AT_ONCE if simulator.advances_rows_at_once else BY_ROW
    some = np.unique(np.linspace(0, len(windows) - 1, most).astype(int))
    index, inside = windows.index[some], windows.inside[some]
    asked = dataclasses.replace(fitter, samples=samples)
    seen = samples.seen[index][..., samples.measured]
    there = np.isfinite(seen) & inside[..., None]
    count = np.maximum(there.sum(axis=1), 1)
    way = np.where(there, seen - nodes[index[:, :1]][..., samples.measured], 0.0)
    usual = np.sqrt((way**2).sum(axis=(0, 1)) / np.maximum(there.sum(axis=(0, 1)), 1))

    def errors(starts: Array) -> Array:
        shown = asked.shown(
            model, index[:, 0], starts, index.shape[1] - 1, none, np.zeros(len(some), int)
        )
        if sizes is not None:
            column = samples.measured == sizes
            shown = np.where(column, np.abs(shown), shown)
        with np.errstate(over="ignore"):  # what runs away is wrong, too
            miss = np.where(there, (shown - seen) / np.where(usual > 0, usual, 1.0), 0.0)
            squares = np.nan_to_num(miss, nan=np.inf) ** 2
        each: Array = np.sqrt(squares.sum(axis=(1, 2)) / np.maximum(count.sum(axis=1), 1))
        return each

    starts = nodes[index[:, 0]]
    each = errors(starts)
    if sizes is not None:
        starts[:, sizes] *= -1.0
        each = np.minimum(each, errors(starts))
    return each
