"""A sensor that is late beside the others: a camera beside encoders, or one behind a filter.

Where all sensors are as late as each other, inputs that act late look the same. One that comes
after the others is no effect of the library: delays and friction are found that make the best of
it. Beside a measured rate its own record tells (``data.kinematics``); alone, forecasts do.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from residual.gap.data.kinematics import earlier
from residual.gap.log import Log
from residual.gap.model.model import Model
from residual.gap.preparation.alternatives import measured_joints
from residual.gap.preparation.prepare import Prepared, prepare
from residual.gap.readings.read import BETTER, WORTH, Asked, Read, error_of
from residual.gap.search.explain import Explanation
from residual.trajectories import Trajectory
from sims.host import HostSimulator

#: Recorded samples by which sensors are read earlier at first, and by how much less and more then.
SAMPLES, FINER = (2.0, 4.0, 8.0), (1.4, 1.2, 1.1)


def a_sensor_earlier(read: Read, asked: Asked) -> Read:
    """The same, or the log with one sensor read earlier, if that clearly explains it better.

    Args:
        read: The log as it is said to be.
        asked: What it is asked so.
    """
    found, nominal = read.found, asked.nominal
    joints = measured_joints(nominal, found.search.fitter.samples)
    if found.adequate or found.search.late or nominal.has_contacts or len(joints) < 2:
        return read
    way = _best(read, nominal, joints, read.error / WORTH**2)
    if way is None:
        return read
    name = nominal.physical_channels[way.joint[0]].name

    def once_more(way: _Way, earlier: Explanation) -> Explanation:
        asked.tell(f"{name} read {way.seconds:.2g} s earlier fits better: once more so")
        return asked.explained(nominal, way.ready, earlier=earlier.search)

    again = once_more(way, found)
    way = _finer(read.log, nominal, way, again)
    again = once_more(way, again)
    says = (
        f"{name} comes about {way.seconds:.2g} s after what else was measured, as from a sensor "
        "that is late or filtered, which no effect of the library is: it was taken to be so much "
        "earlier. Set the clocks right, or leave it out, to be sure"
    )
    earlier = Read(way.log, way.ready, again, (says,))
    if BETTER**2 * earlier.error < read.error:
        return earlier
    asked.tell("not by much: it stays as logged")
    return read


@dataclasses.dataclass(frozen=True)
class _Way:
    """A log with one sensor read earlier.

    Attributes:
        joint: Places of the sensor and of its rates.
        seconds: How much earlier.
        log: So read.
        ready: Its windows.
    """

    joint: Sequence[int]
    seconds: float
    log: Log
    ready: Prepared

    @classmethod
    def of(cls, log: Log, nominal: HostSimulator, joint: Sequence[int], seconds: float) -> _Way:
        """Of a log as it is said to be."""
        log = _earlier(log, joint, seconds)
        return cls(joint, seconds, log, prepare(nominal, log.runs, log.horizon))


def _best(
    read: Read, nominal: HostSimulator, joints: Sequence[Sequence[int]], least: float
) -> _Way | None:
    """The sensor with which what was found forecasts best if it is read earlier; None if none errs
    less than ``least``.

    A longer time is tried where the one before it does better.
    """
    step = read.found.search.fitter.samples.recorded_step
    best = None
    for joint in joints:
        before = WORTH**2 * least
        for samples in SAMPLES:
            way = _Way.of(read.log, nominal, joint, samples * step)
            error = error_of(way.ready, nominal, read.found)
            if error >= before:
                break
            before = error
            if error < least:
                best, least = way, error
    return best


def _finer(log: Log, nominal: HostSimulator, way: _Way, found: Explanation) -> _Way:
    """The same read a little less or more early, if what was found with it fits better so."""
    # Weights by what is left as long as the time is wrong would hide it where it shows.
    fit, like = found.search.tried[found.key], way.ready.fitter

    def loss(one: _Way) -> float:
        fitter = one.ready.fitter.weighed_like(like)
        return float(fitter.fit(Model(nominal, fit.model.chosen), fit.theta).loss.mean())

    least = loss(way)
    for factor in FINER:
        for seconds in (way.seconds / factor, way.seconds * factor):
            near = _Way.of(log, nominal, way.joint, seconds)
            if (its := loss(near)) < least:
                way, least = near, its
    return way


def _earlier(log: Log, joint: Sequence[int], seconds: float) -> Log:
    """The log with some channels as they are read so much later."""

    def moved(runs: Sequence[Trajectory]) -> tuple[Trajectory, ...]:
        for column in joint:
            runs = [earlier(run, column, seconds) for run in runs]
        return tuple(runs)

    return log.read_as(moved)
