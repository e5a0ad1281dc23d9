"""Inputs that were logged a row late: each row holds the command that led to it.

Data sets of episodes, and loops that log at their end, write a state beside the command before it.
Everything then happens a row before its cause, which no effect of the library does, so that time
constants and stores are found that make up for it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from residual.gap.beside import Conventions
from residual.gap.preparation.prepare import prepare
from residual.gap.readings.read import BETTER, WORTH, Asked, Read, error_of
from residual.gap.search.explain import Explanation
from residual.trajectories import Trajectory
from sims.effects.actuator import ActuatorLag, Delay


def a_row_earlier(read: Read, asked: Asked) -> Read:
    """The same, or the log with every input a row earlier, if that clearly explains it better.

    Where only noise is left nothing is asked, nor of what strikes the ground.

    Args:
        read: The log as it is said to be.
        asked: What it is asked so.
    """
    log, found, nominal = read.log, read.found, asked.nominal
    if found.adequate or nominal.has_contacts or not nominal.action_channels:
        return read
    earlier = log.read_as(_shifted)
    if not earlier.runs:
        return read
    ready = prepare(nominal, earlier.runs, log.horizon)
    if WORTH**2 * error_of(ready, nominal, found) > read.error:
        return read
    asked.tell("every input a row earlier fits better: once more so")
    says = (
        "every row was taken to hold the input that led to it, which the data fit better: move "
        "the inputs' columns a row up, or see whether the simulator acts too late"
    )
    again = Read(earlier, ready, asked.explained(nominal, ready), (says,))
    if BETTER**2 * again.error >= read.error or _late_by_a_row(again.found, earlier.runs):
        asked.tell("not by much: inputs stay as logged")
        return read
    if again.found.adequate or again.clearly_better_than(read):
        return again
    names = " and ".join(channel.name for channel in nominal.action_channels)
    row = Conventions((names,), float(np.sqrt(read.error / again.error)), "row")
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
