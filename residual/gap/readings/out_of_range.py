"""A sensor at the end of its range: what it reads there is its own limit, and not the state.

No effect of the library cuts off what is read, so that whatever holds the state back is found: a
saturation, a loss. The same samples may be of a stop or an overflow, which the simulator lacks.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.confirmation.numerics import forecast_error
from residual.gap.data.inspection import measured
from residual.gap.data.windows import TooShort
from residual.gap.log import Log
from residual.gap.preparation.prepare import prepare
from residual.gap.readings.read import Asked, Read
from residual.logs.faults import stretches
from residual.trajectories import Trajectory
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: Samples of a stay at an end, and stays; times that its value is as frequent as those next to it.
LONG, OFTEN, STANDS_OUT = 4, 3, 8.0
#: Values next to it.
NEXT = 5
#: Part of the samples there that is worth asking for, and times that the simulator errs less.
MUCH, FAR_LESS = 0.01, 4.0


def without_an_end(read: Read, asked: Asked) -> Read:
    """The same, or the log without the samples at an end of a channel, if the simulator errs far
    less without them, and what is found is plainer.

    It is not asked of what strikes the ground, nor where there is no gap.

    Args:
        read: The log as it is said to be.
        asked: What it is asked so.
    """
    found, nominal = read.found, asked.nominal
    if nominal.has_contacts or (found.adequate and not found.key):
        return read
    for end in _ends(nominal, read.log.recorded):
        log = read.log.read_as(end.left_out)
        asked.tell(f"{end.channel} stays at the end of its range: once more without those samples")
        try:
            ready = prepare(nominal, log.runs, log.horizon)
        except TooShort:  # it stays there nearly always
            continue
        again = asked.explained(nominal, ready)
        more = again.search.numbers(again.key) - found.search.numbers(found.key)
        plainer = more < 0 or (more == 0 and again.adequate and not found.adequate)
        plainer = plainer or not found.key  # what has no name so may have one
        nominal_errs = FAR_LESS**2 * forecast_error(again.search, ())
        if plainer and nominal_errs < forecast_error(found.search, ()):
            return Read(log, ready, again, (end.says(read.log),))
    return read


@dataclasses.dataclass(frozen=True)
class _End:
    """The greatest or least value of a channel, at which it stays time and again, or both.

    Attributes:
        channel, unit: Its name and unit, as text to follow a number.
        column: Its place among the states.
        values: The end, or both ends.
    """

    channel: str
    unit: str
    column: int
    values: tuple[float, ...]

    def left_out(self, runs: Sequence[Trajectory]) -> tuple[Trajectory, ...]:
        """The runs with those samples as missing."""
        return tuple(self._left_out(run) for run in runs)

    def _left_out(self, run: Trajectory) -> Trajectory:
        states = np.array(run.states, float)
        own = run.states[:, self.column]
        for start, stop in (stay for value in self.values for stay in _stays(own, value)):
            states[start:stop, self.column] = np.nan
        return dataclasses.replace(run, states=states)

    def says(self, log: Log) -> str:
        """What is to be said where it was left out."""
        seen = np.concatenate([run.states[:, self.column] for run in log.recorded])
        ends = " and ".join(f"{value:.4g}" for value in sorted(self.values))
        which = "the ends" if len(self.values) > 1 else "the end"
        there = int(np.isin(seen, self.values).sum())
        return (
            f"{self.channel} stays at {ends}{self.unit}, {which} of all its values, in {there} of "
            f"{len(seen)} samples: a sensor at the end of its range, or a stop or an overflow that "
            "the simulator lacks. They were taken as missing, since what the others show is "
            "explained by less"
        )


def _ends(simulator: HostSimulator, runs: Sequence[Trajectory]) -> Iterator[_End]:
    """Every end at which a channel stays, but zero, where things rest: both together first."""
    names = [channel.name for channel in simulator.physical_channels]
    for channel, values in measured(simulator, runs):
        known = np.concatenate([one[np.isfinite(one)] for one in values])
        found: list[float] = []
        for value in (known.max(), known.min()):
            stays = [stay for one in values for stay in _stays(one, value)]
            there = sum(stop - start for start, stop in stays)
            often = len(stays) >= OFTEN and there > MUCH * len(known)
            if value != 0 and often and there > STANDS_OUT * _next_to(known, value):
                found.append(float(value))
        both = [tuple(found)] if len(found) > 1 else []
        for ends in (*both, *((value,) for value in found)):
            yield _End(channel.name, channel.unit_text, names.index(channel.name), ends)


def _stays(values: Array, end: float) -> list[tuple[int, int]]:
    """Stretches of samples at an end."""
    return [(a, b) for a, b in stretches(values == end) if b - a >= LONG]


def _next_to(known: Array, end: float) -> float:
    """How often the values next to an end were read, in the mean."""
    values, counts = np.unique(known, return_counts=True)
    near = np.argsort(np.abs(values - end))[1 : 1 + NEXT]
    return float(counts[near].mean()) if near.size else 0.0
