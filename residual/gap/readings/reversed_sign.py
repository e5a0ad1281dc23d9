"""A column that counts the other way than said, where that shows only beside what is missing.

An effect that is missing, too, may hide a reversed input: with the right sign the nominal simulator
forecasts hardly better. What explains the log with that sign tells, and does not without.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from residual.gap.beside import Conventions
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.preparation.alternatives import conventions
from residual.gap.preparation.convention import Convention, as_said
from residual.gap.preparation.prepare import prepare
from residual.gap.preparation.way import mean_error
from residual.gap.readings.read import WORTH, Asked, Read
from residual.trajectories import Trajectory

#: Times that what is found has to forecast better with another sign: no physics turns it round.
FAR_BETTER = 2.0


def a_sign_reversed(read: Read, asked: Asked) -> Read:
    """The same, or with the sign told that a column of the log may have, if what is found with it
    explains the log far better.

    Args:
        read: The log as it is said to be.
        asked: What it is asked so.
    """
    found, fitter, nominal = read.found, read.prepared.fitter, asked.nominal
    if found.adequate or not isinstance(fitter, SmoothFitter):
        return read
    signs = [one for one in conventions(nominal, fitter.samples, {}) if one.sign]
    changes = {one.says for one in signs}
    if read.conventions is not None and changes.issuperset(read.conventions.changes):
        return read
    errors = [mean_error(nominal, fitter, one) for one in signs]
    least = min(errors, default=np.inf)
    if WORTH * least > mean_error(nominal, fitter, as_said(nominal)):
        return read
    best = signs[errors.index(least)]
    asked.tell(f"with {best.says} the simulator errs less: once more so")
    log = read.log.read_as(lambda runs: _counted(runs, best))
    ready = prepare(nominal, log.runs, log.horizon)
    again = Read(log, ready, asked.explained(nominal, ready))
    if FAR_BETTER**2 * again.error >= read.error:
        asked.tell("not by much: it stays as logged")
        return read
    alike = tuple(
        one.says for one, error in zip(signs, errors, strict=True) if error < WORTH * least
    )
    times = float(np.sqrt(read.error / again.error))
    return dataclasses.replace(read, conventions=Conventions(alike, times, "found"))


def _counted(runs: Sequence[Trajectory], convention: Convention) -> tuple[Trajectory, ...]:
    """Runs whose columns count so."""
    return tuple(
        dataclasses.replace(
            run,
            states=convention.states_of(run.states),
            actions=convention.inputs_of(run.actions),
        )
        for run in runs
    )
