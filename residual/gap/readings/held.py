"""Inputs that run otherwise between their rows: held to the next one, or straight to it."""

from __future__ import annotations

import contextlib
import dataclasses

from residual.gap.clock import OutOfTime
from residual.gap.confirmation.numerics import fits_better
from residual.gap.preparation.numerics import held_otherwise, how_held
from residual.gap.preparation.prepare import prepare
from residual.gap.readings.read import Asked, Read


def held_the_other_way(read: Read, asked: Asked) -> Read:
    """The same, or the log with inputs held the other way, if that clearly explains it better.

    Args:
        read: The log as it is said to be.
        asked: What it is asked so.
    """
    log, search = read.log, read.found.search
    other = held_otherwise(search.simulator)
    if other is None or not fits_better(search, read.found.key, other):
        return read
    asked.tell("inputs held the other way fit better: once more so")
    ready = prepare(other, log.runs, log.horizon)
    says = (
        f"inputs were taken to {how_held(other)}: the data fit better so; set hold to say otherwise"
    )
    kept = None if read.by_a_row else read.conventions
    with contextlib.suppress(OutOfTime):
        again = Read(log, ready, asked.explained(other, ready, earlier=search), (says,), kept)
        if again.clearly_better_than(read):
            return again
        if not again.found.search.late:
            return read
    says = (
        f"the data fit better with inputs taken to {how_held(other)}, but there was no time to "
        "search so: set hold to say which it is, or give more --minutes"
    )
    return dataclasses.replace(read, says=(says,), conventions=kept)
