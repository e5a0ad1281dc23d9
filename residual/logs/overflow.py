"""Positions that jump by a whole turn, or by all that a counter holds, and go on from there."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from residual.logs.checks import Finding
from residual.logs.layout import LogFormat, named_column
from residual.logs.timing import Run
from residual.logs.units import find_unit
from sims.simulator import TURNS, Channel

Array = NDArray[np.float64]

#: Bits of common counters; and of those whose counts were scaled before they were logged, of which
#: a log shows no more than how fine its values are, and overflows that tell them.
BITS = (8, 10, 12, 14, 16, 24, 32)
SCALED, TWICE = (16, 24, 32), 2
#: How far what is left of a jump may reach, as a multiple of the larger step beside it, or of the
#: usual one.
ALIKE = 2.0
#: Samples that a comparison needs.
FEW = 10
#: Distance from whole numbers that scaling to a unit and back makes, at most.
WHOLE = 1e-4
#: Decimals that values may have, and the largest whole number that is one.
DECIMALS, LARGEST = 6, 2.0**53


class Jump(NamedTuple):
    """What a position jumps by.

    Attributes:
        period: In the unit of the values.
        of: What that is.
    """

    period: float
    of: str


def continued(
    runs: Sequence[Run], channels: Sequence[Channel], columns: LogFormat, findings: list[Finding]
) -> list[Run]:
    """The runs with positions that go on where a counter overflowed, each told as a finding.

    Channels that are declared as angles are not looked at: they are unwrapped anyway.
    """
    continuous = list(runs)
    for index, channel in enumerate(channels):
        if channel.kind != "position" or channel.angle:
            continue
        column = named_column(columns.states.get(channel.name, channel.name), channel.name)
        try:
            factor = column.scale * find_unit(column.unit, channel.unit).factor
        except ValueError:
            continue  # told with the column that has it
        for place, run in enumerate(continuous):
            raw = (run.states[:, index] - column.offset) / factor
            known = np.isfinite(raw)
            jump = jumps_by(raw[known], channel.unit, factor)
            if jump is None:
                continue
            states = run.states.copy()
            states[known, index] += factor * (
                np.unwrap(raw[known], period=jump.period) - raw[known]
            )
            times = int((np.abs(np.diff(raw[known])) > 0.5 * jump.period).sum())
            often = "once" if times == 1 else f"{times} times"
            continuous[place] = dataclasses.replace(run, states=states)
            findings.append(
                Finding(
                    "unwrapped",
                    run.name,
                    f"{channel.name} jumped by {jump.of} {often}, and was continued there.",
                    {"jumps": times},
                    "warning",
                )
            )
    return continuous


def jumps_by(values: Array, unit: str, factor: float) -> Jump | None:
    """What a position jumps by, if it moves on across every jump as it moved beside it.

    Args:
        values: As in the file, (n,), none missing.
        unit: Of the channel.
        factor: From a value to that unit.
    """
    steps = np.diff(values)
    if steps.size < FEW:
        return None
    found = []
    if np.allclose(values, np.round(values), rtol=0.0, atol=WHOLE):
        found += [
            Jump(float(2**bits), f"{2**bits}, as a counter of {bits} bits does,") for bits in BITS
        ]
    elif fine := _resolution(values):
        found += [
            Jump(fine * 2**bits, f"{2**bits} times {fine:g}, as a counter of {bits} bits does,")
            for bits in SCALED
            if (np.abs(steps) > 0.5 * fine * 2**bits).sum() >= TWICE
        ]
    if unit in TURNS:
        found.append(Jump(TURNS[unit] / abs(factor), "a whole turn"))
    found = [jump for jump in found if np.ptp(values) < jump.period * (1 + 1e-6)]
    return next((jump for jump in found if _goes_on(steps, jump.period)), None)


def _resolution(values: Array) -> float | None:
    """By whole times what all values lie apart, (n,), as far as their decimals show it."""
    for digits in range(1, DECIMALS + 1):
        scaled = values * 10**digits
        whole = np.round(scaled)
        if np.abs(whole).max() > LARGEST:
            return None
        if np.allclose(scaled, whole, rtol=0.0, atol=WHOLE):
            return int(np.gcd.reduce(np.diff(whole).astype(np.int64))) / 10**digits or None
    return None


def _goes_on(steps: Array, period: float) -> bool:
    """Whether some steps are jumps by a period, and all of these what is left of them like the
    steps beside them."""
    jumps = np.abs(steps) > 0.5 * period
    if not jumps.any() or jumps.mean() > 0.5 or (np.abs(steps) > 1.5 * period).any():
        return False
    left = steps - period * np.round(steps / period)
    beside = np.abs(np.where(jumps, 0.0, steps))
    beside = np.maximum(np.append(beside[1:], 0.0), np.insert(beside[:-1], 0, 0.0))
    usual = ALIKE * np.maximum(beside, np.median(np.abs(steps)))
    return bool((np.abs(left) <= np.minimum(usual, 0.25 * period))[jumps].all())
