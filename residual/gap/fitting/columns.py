"""What candidates would change in every window, in the linear picture."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.samples import Samples
from residual.gap.data.windows import carry
from residual.gap.fitting.contract import Fit
from residual.gap.fitting.linearised import ShootingFit
from residual.gap.model.candidates import Candidate
from residual.gap.model.model import Model
from residual.gap.model.slopes import Slope, observe

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
    samples, windows = fitter.samples, fitter.blocks.windows
    inner: ShootingFit = fit.inner
    acts, seen = changes(samples, inner.nodes, inner.slope, fit.model, fit.theta, candidates)
    start = np.zeros((inner.nodes.shape[1], 0))
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


def changes(
    samples: Samples,
    nodes: Array,
    slope: Slope,
    model: Model,
    theta: Array,
    candidates: Sequence[Candidate],
) -> tuple[Array, Array]:
    """What every trial of candidates changes after one sample interval, and in what is read.

    Args:
        samples: The measured table.
        nodes: States at every sample, (n, n_s); ``slope``: the model there.
        model: What is there without them, at ``theta``.
        candidates: Of which each is added alone.

    Returns:
        Changes of the next states and of the readings, (n, n_s, trials) each.
    """
    n, width = nodes.shape
    moved: list[Array] = [np.zeros((n, width, 0))]
    shown: list[Array] = [np.zeros((n, width, 0))]
    for candidate in candidates:
        joint = Model(model.simulator, (*model.chosen, candidate))
        values = np.vstack([trial.values for trial in candidate.trials])
        full = np.hstack([np.repeat(theta[None], len(values), axis=0), values])
        states = np.broadcast_to(nodes, (len(values), n, width))
        if joint.width > width:
            physical = nodes[:, : joint.physical]
            play = [joint.widen(samples, physical, t, without=True) for t in full]
            states = np.concatenate([states, np.stack(play)[:, :, width:]], axis=2)
        still = np.zeros((n, width, len(values)))
        if candidate.effect.enters == "sensor":
            moved.append(still)
            seen = joint.sense(states, full) - slope.shown
            shown.append(seen.transpose(1, 2, 0))
        else:
            after = joint.advance(samples, states, full)[..., :width] - slope.after
            moved.append(after.transpose(1, 2, 0))
            shown.append(still)
    return np.concatenate(moved, axis=2), np.concatenate(shown, axis=2)
