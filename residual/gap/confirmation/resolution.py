"""Whether a log resolves an effect: times by its clock, zeros by the steps of a sensor."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from residual.gap.result import Number
from residual.gap.search.sets import Search
from residual.logs.faults import rounding
from sims.effects.actuator import Delay
from sims.effects.sensor import SensorOffset

Array = NDArray[np.float64]

#: Samples below which a time is too short for late stamps and filters to be told apart from it.
BRIEF = 0.5
#: The same of an input that runs straight from sample to sample: half a sample late it is nearly a
#: step, as if it were held.
HELD = 0.75


def untimed(search: Search, number: int, values: Array) -> bool:
    """Whether an effect of the actuator is a time too short for the log's own clock, or delays an
    input that never changes, of which nobody knows when it came on.

    Args:
        search: Holds the log.
        number: The effect's.
        values: Its fitted numbers.
    """
    candidate = search.candidates[number]
    times = [abs(v) for k, v in zip(candidate.knobs, values, strict=True) if k.unit == "s" and v]
    if candidate.effect.enters != "actuator" or not times:
        return False
    samples = search.fitter.samples
    runs, clock = samples.recorded, samples.recorded_step
    inputs = {channel.name: j for j, channel in enumerate(search.simulator.action_channels)}
    acting = [inputs[name] for name in getattr(candidate.effect, "actuators", ())]
    changes = any(np.ptp(run.actions[:, acting], axis=0).any() for run in runs)
    if isinstance(candidate.effect, Delay) and not changes:
        return True
    straight = any(search.simulator.action_channels[j].hold == "linear" for j in acting)
    return bool(min(times) < (HELD if straight else BRIEF) * clock)


def below_a_step(search: Search, number: int, numbers: Mapping[str, Number]) -> bool:
    """Whether the zero of a sensor may be wrong by less than one of the steps that it reads in.

    Args:
        search: Holds the log.
        number: The effect's.
        numbers: Its fitted numbers with their intervals, by field.
    """
    effect = search.candidates[number].effect
    if not isinstance(effect, SensorOffset):
        return False
    names = [channel.name for channel in search.simulator.physical_channels]
    samples, column = search.fitter.samples, names.index(effect.channel)
    step = rounding([samples.seen[start:stop, column] for start, stop in samples.runs])
    offset = numbers["offset"]
    return bool(step) and offset.low < step and offset.high > -step
