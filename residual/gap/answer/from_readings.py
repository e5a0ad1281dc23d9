"""What a corrected simulator makes of the readings themselves.

Forecasts begin where a fit to the readings before them ends. A law that is far off, as a wheel that
hardly grips, begins elsewhere than the readings are, and may do well from there alone.
"""

from __future__ import annotations

import dataclasses
import warnings

import numpy as np
from numpy.typing import NDArray

from residual.gap.answer.confirmed import Answer
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.search.pool import Key

Array = NDArray[np.float64]

#: Error over that of the nominal simulator from which on the corrected one is worse.
WORSE = 1.2
#: Squared error of the nominal simulator over that of its forecasts, up to which readings are good
#: enough to begin from.
AS_GOOD = 2.0


def worse_from_readings(answer: Answer) -> float | None:
    """How many times as much as the nominal simulator the corrected one errs, begun from readings,
    if it does more; None also where not every state was read, or read well.

    Args:
        answer: What was found.
    """
    search, key = answer.found.search, answer.key
    fitter = search.fitter
    if not (key and isinstance(fitter, SmoothFitter)):
        return None
    model = search.tried[key].model
    if len(fitter.samples.measured) < model.width or model.has_sensor:
        return None
    before, after = (_squares(answer, k) for k in ((), key))
    if not np.nansum(before) <= AS_GOOD * np.nansum(search.before.squares):
        return None
    times = search.currency.error(after) / max(search.currency.error(before), 1e-300)
    return times if times > WORSE else None


def not_kept(answer: Answer, times: float) -> tuple[Answer, str]:
    """An answer that names nothing, since the corrected simulator errs so many times as much as the
    nominal one; and what is to be said of that."""
    names = answer.found.search.labels(answer.key)
    says = (
        f"{' and '.join(names)} fits and forecasts better from where the fit begins, and is not "
        f"kept: begun from the readings themselves it errs {times:.2g} times as much as the "
        "nominal simulator"
    )
    leads = tuple(dict.fromkeys((*names, *answer.leads)))
    return dataclasses.replace(answer, key=(), claims=(), leads=leads), says


def _squares(answer: Answer, key: Key) -> Array:
    """Mean squared errors of blocks, (B, m), of forecasts that begin from readings where those of
    the search end their lead."""
    search = answer.found.search
    fitter, fit = search.fitter, search.tried[key]
    assert isinstance(fitter, SmoothFitter)
    windows, samples = fitter.blocks.windows, fitter.samples
    first = fitter.lead.sum(axis=1) - 1
    steps = windows.index.shape[1] - 1 - int(first.min())
    places = np.minimum(first[:, None] + np.arange(steps + 1), windows.index.shape[1] - 1)
    index = np.take_along_axis(windows.index, places, axis=1)
    there = np.take_along_axis(fitter.valid, places[..., None], axis=1)
    there &= (first[:, None] + np.arange(steps + 1) < windows.index.shape[1])[..., None]
    begun, same = samples.seen[index[:, 0]], np.zeros(len(index), int)
    path = fitter.shown(fit.model, index[:, 0], begun, steps, fit.theta[None], same)
    limit = np.nanmax(np.abs(samples.seen[:, samples.measured]), axis=0)
    gap = np.nan_to_num(path - samples.seen[index][..., samples.measured], nan=np.inf)
    square = np.where(there, np.minimum(np.abs(gap), limit) ** 2, np.nan)
    square[:, 0] = np.nan
    blocks = [square[fitter.blocks.block == block] for block in range(len(fitter.blocks))]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # blocks without a reading of a channel
        return np.stack([np.nanmean(own, axis=(0, 1)) for own in blocks])
