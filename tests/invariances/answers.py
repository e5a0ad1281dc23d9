"""Answers of find_gap, and what it means for two of them to be the same."""

from __future__ import annotations

import functools
from pathlib import Path

from changes import CHANGES, joined, other_units
from logs import Log, log

from residual.gap import GapResult, find_gap
from residual.gap.data.examine import examine
from residual.gap.preparation.horizon import usual_horizon

#: Kinds that the answer consists of; the others (minor, what this log cannot show) are notes.
ANSWERS = ("confirmed", "ambiguous", "unexplained", "no_gap")
#: Much more than any of these logs takes, so that a busy machine changes nothing.
MINUTES = 30.0


def ask(given: Log, **options: float) -> GapResult:
    """``find_gap`` with default options."""
    return find_gap(given.simulator, given.runs, minutes=MINUTES, **options)


@functools.cache
def first(name: str) -> GapResult:
    """The answer before anything is changed."""
    return ask(log(name))


def after(name: str, change: str, folder: Path) -> GapResult:
    """The answer after a change."""
    given = log(name)
    if change == "units":
        return ask(other_units(given, folder))
    if change == "horizon":
        runs = examine(given.simulator, given.runs).trajectories
        return ask(given, horizon=1.5 * usual_horizon(given.simulator, runs))
    return ask(CHANGES[change](given))


def names(result: GapResult) -> list[str]:
    """Kinds and names of the answer, in an order of their own."""
    found = []
    for verdict in result.verdicts:
        if verdict.kind in ANSWERS:
            where = "" if verdict.where == verdict.effect else f"@{verdict.where}"
            found.append(f"{verdict.kind} {verdict.effect}{where}".strip())
    return sorted(found)


def moved(one: GapResult, other: GapResult) -> list[str]:
    """Numbers of two answers with the same names that lie outside of each other's interval."""
    pairs = {(v.effect, v.where): v for v in one.verdicts if v.parameters}
    found = []
    for verdict in other.verdicts:
        before = pairs.get((verdict.effect, verdict.where))
        if before is None or verdict.kind not in ANSWERS:
            continue
        for name, now in verdict.parameters.items():
            was = before.parameters[name]
            if not (was.low <= now.value <= was.high or now.low <= was.value <= now.high):
                found.append(
                    f"{verdict.effect} {name}: {was.value:.4g} ({was.low:.4g} to {was.high:.4g}), "
                    f"then {now.value:.4g} ({now.low:.4g} to {now.high:.4g})"
                )
    return found


__all__ = ["after", "ask", "first", "joined", "moved", "names"]
