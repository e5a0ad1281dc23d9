"""Sample times put in order: repeats dropped, runs cut at gaps, and all of it reported."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from residual.logs.checks import Finding
from residual.logs.rounded_clock import even_clock
from residual.logs.table import LogError

Array = NDArray[np.float64]

#: Part of the steps that are no longer than what is usual.
ORDINARY = 0.9


@dataclasses.dataclass(frozen=True)
class Run:
    """Consecutive samples of one file, in SI.

    Attributes:
        path: The file.
        name: For messages.
        rows: Row of the file of each sample, shape (n,).
        times: In s, shape (n,).
        states: One column for each channel that a log can hold, shape (n, n_s), NaN if missing.
        actions: At each sample, shape (n, n_a), NaN if missing.
        converted: Units of columns that are in another one than their channel, by channel.
    """

    path: Path
    name: str
    rows: NDArray[np.int64]
    times: Array
    states: Array
    actions: Array
    converted: Mapping[str, str] = dataclasses.field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.times)

    def take(self, which: NDArray[np.int64] | NDArray[np.bool_] | slice) -> Run:
        """Only some samples."""
        return dataclasses.replace(
            self,
            rows=self.rows[which],
            times=self.times[which],
            states=self.states[which],
            actions=self.actions[which],
        )


def tidy(
    runs: Sequence[Run],
    gap: float,
    minimum: int,
    findings: list[Finding],
    channels: Sequence[str],
) -> list[Run]:
    """Runs with strictly increasing times, an action at every sample but the last, and no gaps.

    Args:
        runs: As recorded, times not decreasing.
        gap: In usual sample periods; a run is cut at longer steps.
        minimum: Samples; a recorded run with fewer is an error, a piece with fewer is left out.
        findings: What is repaired is added here.
        channels: Names of the columns of ``Run.states``.

    Raises:
        LogError: A run is too short, or nothing is left.
    """
    whole: list[Run] = []
    for run in runs:
        pieces = _cut(_ordered(run, minimum, findings), gap, findings)
        long = [piece for piece in map(_trimmed, pieces) if len(piece) >= minimum]
        if len(long) < len(pieces):
            left_out = len(run) - sum(map(len, long))
            says = f"{left_out} samples in pieces shorter than {minimum} were left out."
            findings.append(Finding("left_out", run.name, says, {"samples": left_out}))
        if len(pieces) > 1:
            long = [
                dataclasses.replace(piece, name=f"{run.name} part {number}")
                for number, piece in enumerate(long, start=1)
            ]
        for piece in long:
            findings += _missing(piece, channels)
        whole += long
    if not whole:
        path = runs[0].path if runs else ""
        raise LogError(
            f"no run of at least {minimum} samples is left; check start, stop and gap, and the "
            "findings: " + (" ".join(finding.says for finding in findings[:3]) or "none"),
            path,
        )
    return whole


def report_sampling(runs: Sequence[Run]) -> list[Finding]:
    """How regular the samples of every file are."""
    findings = []
    for path in dict.fromkeys(run.path for run in runs):
        steps = np.concatenate([np.diff(run.times) for run in runs if run.path == path])
        low, period, high = np.quantile(steps, [0.05, 0.5, 0.95])
        late = int((steps > 1.5 * period).sum())
        says = f"{len(steps)} steps of {period:.4g} s in the median"
        if high - low > 0.05 * period:
            says += f"; nine in ten lie between {low:.4g} and {high:.4g} s"
        if late:
            says += f"; {late} are longer than 1.5 periods, as if samples had been dropped"
        numbers = {
            "period_s": float(period),
            "low_s": float(low),
            "high_s": float(high),
            "steps": len(steps),
            "late": late,
        }
        findings.append(Finding("sampling", str(path.name), f"{says}.", numbers))
    return findings


def _ordered(run: Run, minimum: int, findings: list[Finding]) -> Run:
    """Without samples that have no time, or the time of the one before; rounded clocks evened."""
    untimed = int(np.isnan(run.times).sum())
    ordered = run.take(np.isfinite(run.times))
    if untimed:
        says = f"{untimed} samples without a time were dropped."
        findings.append(Finding("untimed", run.name, says, {"samples": untimed}))
    ordered = _once(ordered, findings)
    even, rounding = even_clock(ordered.times)
    if rounding:
        says = (
            f"times were rounded to {rounding:g} s, rows come every "
            f"{float(np.diff(even[:2])[0]):.4g} s: the even clock behind them is used."
        )
        findings.append(Finding("rounded_clock", run.name, says, {"rounding_s": rounding}))
        ordered = dataclasses.replace(ordered, times=even)
    fresh = np.append(True, np.diff(ordered.times) > 0)[: len(ordered)]
    repeats = int((~fresh).sum())
    if repeats:
        row = int(ordered.rows[~fresh][0])
        says = f"{repeats} samples repeat the time before them (first in row {row}); dropped."
        findings.append(Finding("repeated", run.name, says, {"samples": repeats}, "warning"))
        ordered = ordered.take(fresh)
    if len(ordered) < minimum:
        raise LogError(
            f"a trajectory of {len(ordered)} samples ({run.name!r}), expected at least {minimum}; "
            "leave it out, log longer, or set minimum_samples (3 or more) in the columns' file",
            run.path,
            int(run.rows[0]) if len(run) else None,
        )
    return ordered


def _once(run: Run, findings: list[Finding]) -> Run:
    """Without copies, where every sample that repeats the time before it repeats all else, too: a
    log that was written twice, row by row, is none of twice the rate with rounded times."""
    again = np.append(False, np.diff(run.times) == 0)[: len(run)]
    if not again.any():
        return run
    read = np.column_stack([run.states, run.actions])
    if not np.array_equal(read[1:][again[1:]], read[:-1][again[1:]], equal_nan=True):
        return run
    first = int(run.rows[again][0])
    says = f"{again.sum()} samples are copies of the one before (first in row {first}); dropped."
    numbers = {"samples": int(again.sum())}
    findings.append(Finding("repeated", run.name, says, numbers, "warning"))
    return run.take(~again)


def _cut(run: Run, gap: float, findings: list[Finding]) -> list[Run]:
    """Pieces between gaps in time and samples without an action."""
    steps = np.diff(run.times)
    # Where one step in ten is long, that is how the log was sampled, and nothing is missing.
    period = float(max(np.median(steps), np.quantile(steps, ORDINARY)))
    wide = steps > gap * period
    if wide.any():
        longest = float(steps.max())
        first = int(run.rows[:-1][wide][0])
        says = (
            f"{int(wide.sum())} gaps of more than {gap:g} periods, the longest {longest:.4g} s, "
            f"the first after row {first}; cut there. Set columns.gap to go on across them."
        )
        numbers = {"gaps": int(wide.sum()), "longest_s": longest}
        findings.append(Finding("gap", run.name, says, numbers, "warning"))
    # What was done after such a sample is unknown, so nothing can follow from it.
    idle = np.isnan(run.actions[:-1]).any(axis=1)
    if idle.any():
        says = (
            f"{int(idle.sum())} samples without an action, the first in row "
            f"{int(run.rows[:-1][idle][0])}; cut there."
        )
        findings.append(Finding("no_action", run.name, says, {"samples": int(idle.sum())}))
    edges = [0, *(np.flatnonzero(wide | idle) + 1).tolist(), len(run)]
    return [run.take(slice(a, b)) for a, b in itertools.pairwise(edges)]


def _trimmed(run: Run) -> Run:
    """Without samples at either end at which no state was measured."""
    seen = np.flatnonzero(np.isfinite(run.states).any(axis=1))
    return run.take(slice(seen[0], seen[-1] + 1)) if seen.size else run.take(slice(0, 0))


def _missing(run: Run, channels: Sequence[str]) -> list[Finding]:
    findings = []
    for name, values in zip(channels, run.states.T, strict=True):
        gone = np.isnan(values)
        if gone.any() and not gone.all():
            says = (
                f"{name} is missing in {int(gone.sum())} of {len(run)} samples, the first in row "
                f"{int(run.rows[gone][0])}."
            )
            findings.append(Finding("missing", run.name, says, {"samples": int(gone.sum())}))
    return findings
