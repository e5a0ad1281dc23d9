"""Inputs that were logged a row late: each row holds the command that led to it.

Data sets of episodes, and loops that log at their end, write a state beside the command before it.
Everything then happens a row before its cause, which no effect of the library does, so that time
constants and stores are found that make up for it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from residual.gap.beside import Conventions
from residual.gap.confirmation.certainty import CLEARLY
from residual.gap.confirmation.numerics import forecast_error
from residual.gap.preparation.prepare import Prepared, prepare
from residual.gap.read import BETTER, WORTH, Read, error_of
from residual.gap.search.explain import Explanation
from residual.trajectories import Trajectory
from sims.effects.actuator import ActuatorLag, Delay
from sims.host import HostSimulator


def a_row_earlier(
    read: Read,
    nominal: HostSimulator,
    explained: Callable[[HostSimulator, Prepared], Explanation],
    tell: Callable[[str], None],
) -> Read:
    """The same, or the log with every input a row earlier, if that clearly explains it better.

    Where only noise is left nothing is asked, nor of what strikes the ground.

    Args:
        read: The log as it is said to be.
        nominal: The simulator with its inputs held as they are said to be.
        explained: Searches.
        tell: Progress.
    """
    log, found = read.log, read.found
    if found.adequate or nominal.has_contacts or not nominal.action_channels:
        return read
    earlier = dataclasses.replace(
        log, recorded=_shifted(log.recorded), runs=_shifted(log.runs), apart=_shifted(log.apart)
    )
    if not earlier.runs:
        return read
    ready = prepare(nominal, earlier.runs, log.horizon)
    before = forecast_error(found.search, found.key)
    if WORTH**2 * error_of(ready, nominal, found) > before:
        return read
    tell("every input a row earlier fits better: once more so")
    again = explained(nominal, ready)
    after = forecast_error(again.search, again.key)
    if BETTER**2 * after >= before or _late_by_a_row(again, earlier.runs):
        tell("not by much: inputs stay as logged")
        return read
    if again.adequate or CLEARLY**2 * after < before:
        says = (
            "every row was taken to hold the input that led to it, which the data fit better: move "
            "the inputs' columns a row up, or see whether the simulator acts too late"
        )
        return Read(earlier, ready, again, (says,))
    names = " and ".join(channel.name for channel in nominal.action_channels)
    row = Conventions((names,), float(np.sqrt(before / after)), "row")
    return dataclasses.replace(read, conventions=row)


def _late_by_a_row(found: Explanation, runs: Sequence[Trajectory]) -> bool:
    """Whether what was found with inputs a row earlier makes one of them late by that row again."""
    row = float(np.median(np.concatenate([run.durations for run in runs])))
    fit = found.search.tried[found.key]
    added = fit.model.added(fit.theta)
    return any(
        isinstance(effect, Delay | ActuatorLag)
        and any(getattr(effect, name) >= row for name in effect.strengths())
        for effect in added
    )


def _shifted(runs: Sequence[Trajectory]) -> tuple[Trajectory, ...]:
    """Runs whose inputs act a row earlier, without their last row, of which none is known."""
    return tuple(
        dataclasses.replace(
            run, times=run.times[:-1], states=run.states[:-1], actions=run.actions[1:]
        )
        for run in runs
        if len(run) > 1
    )
