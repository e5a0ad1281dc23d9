"""What candidates would change in every window, in the linear picture."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.carrying import carry
from residual.gap.fitting.contract import Fit
from residual.gap.fitting.linearised import ShootingFit
from residual.gap.model.candidates import Candidate
from residual.gap.model.model import Model
from residual.gap.model.slopes import observe

if TYPE_CHECKING:
    from residual.gap.fitting.smooth import SmoothFitter

Array = NDArray[np.float64]


def columns(
    fitter: SmoothFitter, fit: Fit, candidates: Sequence[Candidate], share: Array | None = None
) -> Array:
    """See ``Fitter.columns``.

    A candidate acts for one sample interval from every row, and the change it makes is carried
    linearly along the window: one batch serves all windows, and none runs away. ``share`` is how
    much it acts from each row, (n,), fully by default; or several of them, (k, n), for each of
    which the first trial alone has a column.
    """
    if not candidates:
        return np.zeros((*fit.projected.shape, 0))
    model, samples, windows = fit.model, fitter.samples, fitter.blocks.windows
    inner: ShootingFit = fit.inner
    n, width = inner.nodes.shape
    values = [np.vstack([trial.values for trial in one.trials]) for one in candidates]
    acts = np.zeros((n, width, sum(map(len, values))))
    # What is seen of sensors by themselves, with the place of its columns.
    seen: list[tuple[slice, Array]] = []
    begin = 0
    for candidate, given in zip(candidates, values, strict=True):
        joint = Model(model.simulator, (*model.chosen, candidate))
        own = slice(begin, begin + len(given))
        begin = own.stop
        theta = np.hstack([np.repeat(fit.theta[None], len(given), axis=0), given])
        states = np.broadcast_to(inner.nodes, (len(given), n, width))
        if joint.width > width:
            nodes = inner.nodes[:, : joint.physical]
            play = [joint.widen(samples, nodes, t, without=True) for t in theta]
            states = np.concatenate([states, np.stack(play)[:, :, width:]], axis=2)
        if candidate.effect.enters == "sensor":
            shown = joint.sense(states, theta) - inner.slope.shown
            seen.append((own, shown.transpose(1, 2, 0)))
        else:
            after = joint.advance(samples, states, theta)[..., :width] - inner.slope.after
            acts[..., own] = after.transpose(1, 2, 0)
    if share is not None:
        acts, seen = _shared(acts, share), [(own, _shared(shown, share)) for own, shown in seen]
        if share.ndim == 2:
            seen = [(slice(None), shown) for _, shown in seen[:1]]
    response = carry(windows, inner.slope.by_state, np.zeros((width, 0)), acts)
    found = observe(samples, windows, inner.slope, response, fitter.sigma)
    for own, shown in seen:
        direct = shown[:, samples.measured][windows.index] / fitter.sigma[:, None]
        found[..., own] += direct * fitter.valid[..., None]
    return found.reshape(len(windows), -1, found.shape[-1])


def _shared(columns: Array, share: Array) -> Array:
    """Columns (n, n_s, c) that act by a share from each row, (n,); or the first of them by several,
    (k, n), one after the other."""
    if share.ndim == 2:
        return columns[..., :1] * share.T[:, None, :]
    return columns * share[:, None, None]
