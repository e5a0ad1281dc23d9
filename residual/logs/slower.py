"""Inputs that were logged in fewer rows than the states, blank between."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.logs.checks import Finding
from residual.logs.timing import ORDINARY, Run
from sims.simulator import Channel

Array = NDArray[np.float64]

#: Readings below which nobody knows how often an input was logged.
FEW = 5
#: Usual times between readings after which an input is no longer what it was.
LONGEST = 3.0


def filled(run: Run, channels: Sequence[Channel], findings: list[Finding]) -> Run:
    """A run whose inputs go on between the rows that they were logged in.

    An input that is blank after more than half of its readings was logged less often than the rows
    come, as where the topics of a robot are joined by time. A command is held; what runs straight
    between samples (``hold="linear"``) runs so here. After three times the usual time between
    readings it is not known any more, as where an input is blank now and then.

    Args:
        run: As it was recorded.
        channels: Of its actions.
        findings: What was filled is added here.
    """
    actions = run.actions.copy()
    for column, channel in enumerate(channels):
        values = run.actions[:, column]
        known = np.flatnonzero(np.isfinite(values) & np.isfinite(run.times))
        if len(known) < FEW or not np.mean(np.diff(known) > 1) > 0.5:
            continue
        usual = float(np.quantile(np.diff(run.times[known]), ORDINARY))
        last = np.searchsorted(known, np.arange(len(values)), side="right") - 1
        since = run.times - run.times[known[np.maximum(last, 0)]]
        there = (last >= 0) & (since <= LONGEST * usual)
        if channel.hold == "linear":
            between = np.interp(run.times, run.times[known], values[known])
            there &= np.arange(len(values)) <= known[-1]
        else:
            between = values[known[np.maximum(last, 0)]]
        actions[:, column] = np.where(np.isfinite(values), values, np.where(there, between, np.nan))
        blank = int(np.isnan(values).sum())
        how = "taken to run straight" if channel.hold == "linear" else "held"
        says = (
            f"{channel.name} was logged every {usual:.3g} s and is blank in {blank} of "
            f"{len(values)} rows: {how} between its readings."
        )
        findings.append(Finding("slower_input", run.name, says, {"blank": blank, "every_s": usual}))
    return dataclasses.replace(run, actions=actions)
