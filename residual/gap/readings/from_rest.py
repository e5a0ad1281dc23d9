"""Records that begin with an input on: what came before may have been none, or the same."""

from __future__ import annotations

import dataclasses

from residual.gap.confirmation.rest import fits_better_from_rest
from residual.gap.preparation.prepare import prepare
from residual.gap.readings.read import Asked, Read

#: Records that are listed.
FEW = 3


def begun_from_rest(read: Read, asked: Asked) -> Read:
    """The same, or the log with records that begin from rest, if that clearly explains it better.

    Args:
        read: The log as it was read.
        asked: What it is asked so.
    """
    log, search = read.log, read.found.search
    runs = None if search.late else fits_better_from_rest(search, read.found.key, log.runs)
    if runs is None:
        return read
    asked.tell("what came before the records fits better as no input: once more so")
    ready = prepare(search.simulator, runs, log.horizon)
    late = [run.name for run in runs if run.before is not None]
    more = f" and {len(late) - FEW} more" if len(late) > FEW else ""
    says = (
        f"{', '.join(late[:FEW])}{more}: the first input is on, and what came before is taken to "
        "be rest, which the data fit better; log some samples from before to be sure"
    )
    again = dataclasses.replace(
        read,
        log=dataclasses.replace(log, runs=runs),
        prepared=ready,
        found=asked.explained(search.simulator, ready, earlier=search),
        says=(*read.says, says),
    )
    return again if again.clearly_better_than(read) else read
