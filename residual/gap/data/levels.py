"""Measured states and inputs as courses that a number may follow."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.samples import Samples
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: Quantiles of what was measured between which a number changes.
ENDS = 0.05, 0.95


@dataclasses.dataclass(frozen=True)
class Level:
    """A channel as a course from -1/2 to 1/2.

    Attributes:
        channel, unit: Its name and unit.
        of_size: Whether its size counts.
        low, high: Its values at the two ends.
        reach: Its least and its greatest value.
        course: By row, (n,).
    """

    channel: str
    unit: str
    of_size: bool
    low: float
    high: float
    reach: tuple[float, float]
    course: Array


def levels(simulator: HostSimulator, samples: Samples) -> Iterator[Level]:
    """Every measured state and input that changes, and the sizes of those of both signs."""
    states, inputs = simulator.physical_channels, simulator.action_channels
    columns = [(states[column], samples.seen[:, column]) for column in samples.measured]
    for channel, column in (*columns, *zip(inputs, samples.actions.T, strict=True)):
        sizes = {False: column}
        if np.nanmin(column) < 0:
            sizes[True] = np.abs(column)
        for of_size, values in sizes.items():
            low, high, *reach = map(float, np.nanquantile(values, [*ENDS, 0.0, 1.0]))
            if high > low:
                course = np.clip((values - low) / (high - low), 0.0, 1.0) - 0.5
                course = np.where(np.isfinite(course), course, 0.0)
                yield Level(
                    channel.name, channel.unit, of_size, low, high, (reach[0], reach[1]), course
                )
