"""Delays and lags of some of several inputs that late or filtering sensors nearly imitate."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.search.sets import Search
from sims.effects.actuator import ActuatorEffect
from sims.effects.base import Effect
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: How much it may matter that the other inputs are not late, beside those that are.
LITTLE = 0.1
#: Rows at which that is asked.
ROWS = 300


def nearly_in_sensors(effects: Iterable[Effect], search: Search) -> tuple[str, ...]:
    """Delays and lags of some inputs that look as if all of them had it.

    Sensors that are all late look exactly like inputs that are all late. Of an input that hardly
    changes in that time, as a car's speed beside its steering, it does not show.

    Args:
        effects: What was found.
        search: With the nominal simulator, the log, and states at its rows.

    Returns:
        Their labels; those that act on all inputs look exactly so, and are left out.
    """
    simulator, fitter = search.simulator, search.fitter
    if not isinstance(fitter, SmoothFitter):
        return ()
    late = [e for e in effects if e.looks_like and isinstance(e, ActuatorEffect)]
    names = [channel.name for channel in simulator.action_channels]
    found = []
    for effect in late:
        (strength,) = effect.strengths()
        time = float(np.mean(getattr(effect, strength)))
        own = [names.index(name) for name in effect.actuators]
        others = [j for j in range(len(names)) if j not in own]
        if others:
            matters = _matters(simulator, fitter, time)
            if max(matters[others]) <= LITTLE * min(matters[own]):
                found.append(str(effect))
    return tuple(found)


def _matters(simulator: HostSimulator, fitter: SmoothFitter, time: float) -> Array:
    """By how much one control period ends elsewhere if an input is late by a time, (n_a,)."""
    # Its own effects may have memory, which these states do not hold.
    simulator, samples = simulator.with_effects(()), fitter.samples
    rows = np.unique(np.linspace(0, len(samples) - 1, min(len(samples), ROWS)).astype(int))
    states = fitter.nodes[rows, : len(simulator.physical_channels)]
    scale = np.maximum(fitter.scale[: states.shape[1]], 1e-300)
    before = simulator.step(states, samples.actions[rows])
    found = []
    for j in range(samples.actions.shape[1]):
        actions = samples.actions.copy()
        for start, stop in samples.runs:
            times = samples.times[start:stop]
            actions[start:stop, j] = np.interp(times - time, times, actions[start:stop, j])
        moved = (simulator.step(states, actions[rows]) - before) / scale
        found.append(np.sqrt(np.nanmean(moved**2)))
    return np.array(found)
