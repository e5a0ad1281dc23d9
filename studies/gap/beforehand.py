"""What has to be seen before an answer is believed, since no effect undoes it."""

from __future__ import annotations

from residual.gap import GapResult
from studies.gap.words import listed


def seen_first(result: GapResult) -> str:
    """What the log may count otherwise than the simulator, what that cuts off by mistake, or that
    its integration step shows."""
    return _conventions(result) or _cut_off(result) or _step(result)


def _conventions(result: GapResult) -> str:
    other = result.conventions
    if other is None:
        return ""
    changes = f"{' or '.join(other.changes)} in the column map"
    errs = f"with {changes} the nominal simulator errs {_times(other.times)} times less"
    why = {
        "forecasts": errs,
        "zero": errs,
        "pace": f"{errs}, as where times were made up from a period that was not kept",
        "sign": f"what fits acts the other way, as with {changes}",
        "scale": f"a channel is {other.times:.0f} times the scale that it declares, as without "
        f"{changes}",
        "row": f"with {' and '.join(other.changes)} a row earlier in the log, what is found errs "
        f"{_times(other.times)} times less, as where rows hold the command that led to them",
        "found": f"with {changes} what is found errs {_times(other.times)} times less",
        "size": f"but for {other.changes[0]}, which never goes below zero in the log, the nominal "
        f"simulator errs {_times(other.times)} times less, as where a sensor does not tell which "
        "way",
    }[other.reason]
    return f"First see whether the log counts as the simulator does: {why}. If that is not it: "


def _times(times: float) -> str:
    """Two digits, without an exponent."""
    return f"{float(f'{times:.2g}'):g}"


def _cut_off(result: GapResult) -> str:
    """What the simulator does not answer to, where something was found that may make up for it."""
    if not result.cut_off or not result.effects:
        return ""
    return (
        f"First see whether the simulator is meant to cut {listed(list(result.cut_off))} off where "
        "it does (below): what was found may make up for it. If it is: "
    )


def _step(result: GapResult) -> str:
    """That the integration step shows in the log, where something was found that may make up for
    it."""
    if not result.effects or all(finding.kind != "step" for finding in result.quality):
        return ""
    return (
        "First see the simulator's integration step, which shows in this log (below): what was "
        "found may make up for it. If that is not it: "
    )
