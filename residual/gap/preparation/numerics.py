"""Numerics before physics: thinning of fast logs, sub-steps, and how inputs run between samples.

An integration error or a wrong hold is as systematic as a missing effect and would be given its
name, so both are settled on the nominal simulator.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.samples import Samples
from residual.gap.model.model import Model
from residual.trajectories import Trajectory
from sims.host import HostSimulator
from sims.simulator import Hold

Array = NDArray[np.float64]

#: Rows in a forecast horizon that are enough to follow the motion.
ROWS = 24
#: Error of one interval by too few sub-steps, as a share of what counts; those of a window add up.
FINE = 0.01


def stride_for(trajectories: Sequence[Trajectory], horizon: float) -> int:
    """Recorded samples in an interval, so that a horizon has about ``ROWS`` rows.

    Where most samples come close together, with long pauses between them, the middle step is not
    what a row takes.
    """
    durations = np.concatenate([t.durations for t in trajectories])
    step = max(float(np.median(durations)), 0.5 * float(durations.mean()))
    wanted = max(1, int(horizon / ROWS / step + 1e-9))
    # Powers of two, so that an interval has whole sub-steps of recorded ones.
    return 2 ** int(np.log2(wanted))


def own_substeps(simulator: HostSimulator, trajectories: Sequence[Trajectory], stride: int) -> int:
    """Sub-steps of an interval that are as fine as the simulator's own.

    Of a thinned log a power of two, as its stride is: whole recorded samples, or parts of them.
    """
    longest = stride * max(float(np.quantile(t.durations, 0.95)) for t in trajectories)
    own = max(1, int(np.ceil(simulator.substeps * longest / simulator.dt - 1e-6)))
    return own if stride == 1 else _power(own)


def enough_substeps(
    simulator: HostSimulator, samples: Samples, nodes: Array, sigma: Array, most: int
) -> int:
    """As few sub-steps as change nothing that could be seen, at most ``most``.

    The simulator is advanced from rows of the table with so many sub-steps and twice as
    many; the worst twentieth of the rows decides. What friction holds begins to move where an input
    jumps, seldom and far, so that sub-steps are then no longer than recorded intervals.

    Args:
        simulator: The nominal simulator, or with what was found.
        samples: The table.
        nodes: States at its rows, (n, n_s).
        sigma: Error of every measured channel that counts one, (m,).
        most: The simulator's own.
    """
    if not simulator.advances_rows_at_once:
        return most
    model = Model(simulator)
    rows = np.unique(np.linspace(0, len(samples) - 1, min(len(samples), 400)).astype(int))
    states = model.widen(samples, nodes[:, : model.physical], np.zeros(0))[rows][None]

    def after(count: int) -> Array:
        table = dataclasses.replace(samples, substeps=count)
        return Model(simulator).advance(table, states, np.zeros((1, 0)), rows)[0]

    held = any(effect.holds_still and not effect.absent for effect in simulator.effects)
    count = min(samples.stride, most) if held else 1
    coarse = after(count)
    while count < most:
        fine = after(min(2 * count, most))
        change = np.abs(fine - coarse)[:, samples.measured]
        if (np.quantile(change, 0.95, axis=0) <= FINE * sigma).all():
            return count
        count, coarse = min(2 * count, most), fine
    return most


def enough_for(
    corrected: HostSimulator, simulator: HostSimulator, samples: Samples, nodes: Array,
    sigma: Array, most: int,
) -> int:  # fmt: skip
    """The same of a simulator with what was found, which may need finer steps than without it, as
    friction that holds does; of the nominal one if effects remember."""
    remembers = Model(corrected).width != len(corrected.physical_channels)
    return enough_substeps(simulator if remembers else corrected, samples, nodes, sigma, most)


def held_as(simulator: HostSimulator, hold: Hold | Mapping[str, Hold] | None) -> HostSimulator:
    """The simulator with its inputs held as given, or as its channels say."""
    if hold is None:
        return simulator
    names = [channel.name for channel in simulator.action_channels]
    return simulator.with_hold(hold if isinstance(hold, Mapping) else dict.fromkeys(names, hold))


def held_otherwise(simulator: HostSimulator) -> HostSimulator | None:
    """The simulator with all inputs held the other way; None if that is no question."""
    if not simulator.action_channels or simulator.has_contacts:
        return None
    return simulator.with_hold(
        {c.name: "zero" if c.hold == "linear" else "linear" for c in simulator.action_channels}
    )


def how_held(simulator: HostSimulator) -> str:
    """How the inputs run between samples, in words."""
    if simulator.action_channels[0].hold == "linear":
        return "run straight from sample to sample"
    return "be held between samples"


def _power(count: int) -> int:
    """The smallest power of two that is not smaller."""
    return 2 ** int(np.ceil(np.log2(count)))
