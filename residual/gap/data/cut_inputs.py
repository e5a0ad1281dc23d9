"""Inputs that were cut off where they were recorded: what acted was larger."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.logs.checks import Finding
from residual.logs.faults import stretches
from residual.trajectories import Trajectory, moment
from sims.host import HostSimulator
from sims.simulator import Channel

Array = NDArray[np.float64]

#: Samples in a row at the end of all values, and how often at the least.
LONG, OFTEN = 3, 3
#: Times as often as at any other value in the outer quarter of the range, and distinct values of
#: all others at the least: commands may be chosen from a few, and return to each.
TIMES, OUTER, OTHERS = 3, 0.25, 10
#: Part of the range by which an end differs from a bound that is declared, or from nothing.
APART = 1e-3


def cut_inputs(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> list[Finding]:
    """Inputs that come back to exactly their largest value and stay there, and to no other.

    A bound that the channel declares is the actuator's; at any other the recorder may have cut off
    what acted. Zero is where a drive rests.

    Args:
        simulator: Has the inputs and their bounds.
        trajectories: Measured runs.
    """
    found = []
    for column, channel in enumerate(simulator.action_channels):
        inputs = [run.actions[:, column] for run in trajectories]
        every = np.concatenate(inputs)
        ends = [e for e in (every.min(), every.max()) if not _meant(channel, e, np.ptp(every))]
        at = [(e, stays) for e in ends if (stays := _stays(inputs, e))]
        if not at:
            continue
        values = " and ".join(f"{e:.4g}" for e, _ in at)
        there = [one for _, stays in at for one in stays]
        samples = sum(stop - start for _, start, stop in there)
        number, start, _ = min(there)
        run = trajectories[number]
        says = (
            f"stays at {values}{channel.unit_text}, the end of all its values, {len(there)} times "
            f"({samples} of {len(every)} samples, the first at {moment(float(run.times[start]))} "
            f"of {run.name}), and comes back to no other value so often: if the recorder cut it "
            "off, log what acts; if the controller did, all is well"
        )
        found.append(Finding("cut", channel.name, says, {"samples": samples}, "warning"))
    return found


def _meant(channel: Channel, end: float, span: float) -> bool:
    """Whether an end is a bound that is declared, or nothing."""
    return any(abs(end - known) <= APART * span for known in (channel.low, channel.high, 0.0))


def _stays(inputs: Sequence[Array], end: float) -> list[tuple[int, int, int]]:
    """Stretches at an end, as (run, first sample, one past the last), if they are such."""
    found = [
        (run, start, stop)
        for run, values in enumerate(inputs)
        for start, stop in stretches(values == end)
        if stop - start >= LONG
    ]
    every = np.concatenate([values[np.diff(values, prepend=np.nan) != 0] for values in inputs])
    others, times = np.unique(every[every != end], return_counts=True)
    near = times[np.abs(others - end) <= OUTER * np.ptp(every)]
    often = max(OFTEN, TIMES * int(near.max(initial=0)))
    return found if len(others) >= OTHERS and len(found) >= often else []
