"""Windows of a few control steps, cut from runs and laid out for shooting."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.samples import Samples
from residual.gap.data.windows import Windows
from residual.gap.fitting.impacts.noise import first_guess, with_noise
from residual.gap.fitting.impacts.single_shooting import KNOWN, WindowData
from residual.gap.model import paths
from residual.gap.model.model import Model
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: Least intervals in a window: shorter ones say little where rates were not measured.
STEPS = 5
#: Length of a window as a part of the horizon.
PART = 0.3


def steps_for(samples: Samples, horizon: float) -> int:
    """Intervals in a window: a part of the horizon, of which forecasts go on from its end.

    In longer ones most windows hold an impact on which simulators differ, and past it start states
    make up for what is missing.
    """
    return max(STEPS, round(PART * horizon / samples.step))


def pieces(samples: Samples, steps: int) -> list[tuple[int, int, int]]:
    """(run, first row, one past last row) of windows that share their end points.

    The first sample of a run is left out: what was commanded before it is not known.

    Raises:
        ValueError: No run is long enough for a window.
    """
    found = [
        (run, a, a + steps + 1)
        for run, (start, stop) in enumerate(samples.runs)
        for a in range(start + 1, stop - steps, steps)
    ]
    if not found:
        raise ValueError(
            f"every run is shorter than {steps + 2} samples, the least for a window of half a "
            "horizon: log longer runs, or ask for a shorter horizon"
        )
    return found


def lay_out(
    simulator: HostSimulator, samples: Samples, cut: list[tuple[int, int, int]], exact: bool
) -> WindowData:
    """Windows with a first guess of start states and noise; ``exact``: no guess, but known."""
    model = Model(simulator)
    windows = Windows.cut(cut)
    nodes = paths.measured(model, samples, np.zeros(0))
    scale = scales(simulator)
    measured = np.isin(np.arange(len(scale)), samples.measured)
    doubt = np.where(measured, KNOWN if exact else np.inf, scale)
    channels = simulator.physical_channels
    names = [channel.name for channel in channels]
    step = float(np.median(samples.durations))
    sigma = first_guess(samples, nodes)
    data = WindowData(samples, windows, sigma, nodes[windows.index[:, 0]], doubt, 1e-3 * scale)
    data = with_noise(data, sigma, scale)
    for i, channel in enumerate(channels):
        if not measured[i] and channel.rate_of in names:
            data.moves[i] = 0.5 * 1e-3 * scale[names.index(str(channel.rate_of))] / step
    return data


def scales(simulator: HostSimulator) -> Array:
    """Typical size of every physical state, (n_p,)."""
    return np.array([channel.scale for channel in simulator.physical_channels])


def some(cut: list[tuple[int, int, int]], most: int) -> list[tuple[int, int, int]]:
    """At most so many windows, spread evenly over the log."""
    if len(cut) <= most:
        return cut
    return [cut[int(i)] for i in np.linspace(0, len(cut) - 1, most).round()]
