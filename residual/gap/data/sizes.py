"""Columns whose size says that they are in another unit, and angles that were cut at a turn."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.inspection import measured, refusal
from residual.logs.checks import Finding
from residual.logs.units import other_units
from residual.trajectories import Trajectory, moment
from sims.host import HostSimulator
from sims.simulator import UNDECLARED, Channel

Array = NDArray[np.float64]

#: Times the size that a channel declares, or part of it, from which on another unit is asked after,
#: and how near to that size values have to be in it.
FAR, NEAR = 50.0, 4.0
#: Temperature in K that no column of a simulator with a warmer parameter stays below.
COLD = 200.0
#: How nearly a jump has to be a turn, and the share of it that no other step reaches.
ALMOST, SMALL = 0.03, 0.3


def sizes(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> list[Finding]:
    """Columns that move far more or far less than declared, as they would not in another unit."""
    found = []
    converted = frozenset[str]().union(*(run.converted for run in trajectories))
    for channel, size, declared in _sizes(simulator, trajectories):
        times = size / declared
        if not times > 0.0 or 1 / FAR < times < FAR:
            continue
        units = other_units(channel.unit)
        near = [
            *(f"`unit: {n}`" for n, unit in units if _near(times * unit.factor)),
            *(f"`unit: {channel.unit}` in place of {n}" if channel.name in converted
              else f"`scale: {1 / unit.factor:g}`"
              for n, unit in units if _near(times / unit.factor)),
        ]  # fmt: skip
        if near:
            says = (
                f"has a size of {size:.3g} {channel.unit}, where {declared:.3g} {channel.unit} "
                f"are declared: if it counts otherwise than read, set {' or '.join(near[:3])}"
            )
            found.append(Finding("size", channel.name, says, {"times": times}, "warning"))
    return found


def too_cold(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> list[Finding]:
    """Temperatures in K that are those of another zero, beside what the simulator knows of."""
    warm = [
        (float(np.max(parameter.value)), name)
        for name, parameter in simulator.parameters.items()
        if parameter.unit == "K" and float(np.max(parameter.value)) > COLD
    ]
    if not warm:
        return []
    value, name = max(warm)
    columns = [
        *measured(simulator, trajectories),
        *(
            (channel, [run.actions[:, column] for run in trajectories])
            for column, channel in enumerate(simulator.action_channels)
        ),
    ]
    found = []
    for channel, runs in columns:
        if channel.unit != "K":
            continue
        most = float(_known(runs).max(initial=-np.inf))
        if most >= COLD:
            continue
        says = (
            f"is never warmer than {most:.3g} K, where {name} is {value:.3g} K: if the column "
            "counts from 0 degC, set `unit: degC`"
        )
        found.append(Finding("size", channel.name, says, {"most": most}, "warning"))
    return found


def _sizes(
    simulator: HostSimulator, trajectories: Sequence[Trajectory]
) -> Iterator[tuple[Channel, float, float]]:
    """Channels with the size of their values and the one that they declare: of states the range
    of nine tenths of them, of inputs the largest.

    Inputs that are far larger are asked after where forecasts are compared. Whether a rate is in
    the unit of its position, if that was measured, ``kinematics`` says.
    """
    columns = measured(simulator, trajectories)
    names = {channel.name for channel, _ in columns}
    for channel, runs in columns:
        vague = channel.angle or channel.invariant or channel.rate_of in names
        if channel.scale != UNDECLARED and not vague:
            low, high = np.quantile(_known(runs), [0.05, 0.95])
            yield channel, float(high - low), channel.scale
    for column, channel in enumerate(simulator.action_channels):
        bounds = [abs(bound) for bound in (channel.low, channel.high) if np.isfinite(bound)]
        declared = channel.scale if channel.scale != UNDECLARED else max(bounds, default=0.0)
        size = float(
            np.abs(_known([run.actions[:, column] for run in trajectories])).max(initial=0.0)
        )
        if 0.0 < size < declared:
            yield channel, size, declared


def _known(runs: Sequence[Array]) -> Array:
    values = np.concatenate(list(runs))
    return values[np.isfinite(values)]


def _near(times: float) -> bool:
    return 1 / NEAR <= times <= NEAR


def wrapped(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> list[Finding]:
    """Angles that jump by a turn, of channels that do not say that they are angles."""
    found = []
    for channel, runs in measured(simulator, trajectories):
        turn = channel.turn
        if turn is None or channel.angle:
            continue
        steps = [np.abs(np.diff(values)) for values in runs]
        jumps = [np.abs(step - turn) < ALMOST * turn for step in steps]
        others = _known([step[~jump] for step, jump in zip(steps, jumps, strict=True)])
        rows = [
            f"{moment(run.times[row + 1])} of {run.name}"
            for run, jump in zip(trajectories, jumps, strict=True)
            for row in np.flatnonzero(jump)
        ]
        if rows and (not others.size or others.max() < SMALL * turn):
            often = "once" if len(rows) == 1 else f"{len(rows)} times"
            fix = "declare it with angle=True" if channel.unit == "rad" else "unwrap the column"
            says = (
                f"jumps by a whole turn {often} (the first at {rows[0]}), as an angle "
                f"does that is cut there: {fix} (numpy.unwrap(values, period={turn:.6g}))"
            )
            found.append(refusal("wrapped", channel.name, says))
    return found
