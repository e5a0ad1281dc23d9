"""Whether what moves forgets from sample to sample where it was.

Then a log shows where motion settles, and next to nothing of how. A dead zone and dry friction, a
bent input and drag are one curve there; what is left of a transient tells them apart only as far as
the simulator's own time constant is right.
"""

from __future__ import annotations

import numpy as np

from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.search.sets import Search

#: Part of a deviation that is left after one sample, in scales of the channels, up to which it is
#: forgotten.
FORGOTTEN = 0.05
#: Samples that are looked at, and the deviation there.
ROWS, SLIGHT = 50, 1e-3


def settled(search: Search, group: int) -> bool:
    """Whether the rates of a joint, or its only state, hardly depend on the sample before.

    Args:
        search: With the nominal simulator and its path.
        group: The joint, as in ``search.currency``.
    """
    if not isinstance(search.fitter, SmoothFitter):
        return False
    samples, channels = search.fitter.samples, search.simulator.physical_channels
    own = [int(samples.measured[place]) for place in search.currency.groups[group]]
    own = [c for c in own if channels[c].kind == "rate"] or own
    rows = np.unique(np.linspace(0, len(samples) - 2, ROWS).astype(int))
    nodes, scales = search.nominal.inner.nodes[rows], np.array([c.scale for c in channels])
    moved = np.repeat(nodes[None], 1 + len(channels), axis=0)
    for i, scale in enumerate(scales):
        moved[1 + i, :, i] += SLIGHT * scale
    model = search.nominal.model
    after = model.advance(samples, moved, np.zeros((len(moved), 0)), rows)[..., own]
    left = np.abs(after[1:] - after[0]) / (SLIGHT * scales[own])
    return bool(np.nanmedian(left, axis=1).max() < FORGOTTEN)
