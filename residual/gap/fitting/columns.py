"""What candidates would change in every window, in the linear picture."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.windows import carry
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
    moved: list[Array] = []
    shown: list[Array] = []
    for candidate in candidates:
        joint = Model(model.simulator, (*model.chosen, candidate))
        values = np.vstack([trial.values for trial in candidate.trials])
        theta = np.hstack([np.repeat(fit.theta[None], len(values), axis=0), values])
        states = np.broadcast_to(inner.nodes, (len(values), n, width))
        if joint.width > width:
            nodes = inner.nodes[:, : joint.physical]
            play = [joint.widen(samples, nodes, t, without=True) for t in theta]
            states = np.concatenate([states, np.stack(play)[:, :, width:]], axis=2)
        still = np.zeros((n, width, len(values)))
        if candidate.effect.enters == "sensor":
            moved.append(still)
            seen = joint.sense(states, theta) - inner.slope.shown
            shown.append(seen.transpose(1, 2, 0))
        else:
            after = joint.advance(samples, states, theta)[..., :width] - inner.slope.after
            moved.append(after.transpose(1, 2, 0))
            shown.append(still)
    start, acts = np.zeros((width, 0)), np.concatenate(moved, axis=2)
    seen = np.concatenate(shown, axis=2)
    if share is not None and share.ndim == 2:
        acts, seen = (some[..., :1] * share.T[:, None, :] for some in (acts, seen))
    elif share is not None:
        acts = acts * share[:, None, None]
    response = carry(windows, inner.slope.by_state, start, acts)
    found = observe(samples, windows, inner.slope, response, fitter.sigma)
    measured = samples.measured
    direct = seen[:, measured][windows.index] / fitter.sigma[:, None]
    found = found + direct * fitter.valid[..., None]
    return found.reshape(len(windows), -1, found.shape[-1])
