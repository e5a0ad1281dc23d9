"""Columns whose size says that they are in another unit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.inspection import measured
from residual.logs.checks import Finding
from residual.logs.units import other_units
from residual.trajectories import Trajectory, converted_units
from sims.host import HostSimulator
from sims.simulator import UNDECLARED, Channel

Array = NDArray[np.float64]

#: Times the size that a channel declares, or part of it, from which on another unit is asked after
#: (a radian has twice as many degrees), and how near to that size values have to be in it.
FAR, NEAR = 30.0, 4.0
#: Size over the bound of an input that is its bound.
ROUNDED = 1.05
#: Temperature in K that no column of a simulator with a warmer parameter stays below; 0 degC in K;
#: what rooms and weather are between, in degC.
COLD, ZERO, OUTSIDE = 200.0, 273.15, (-10.0, 50.0)


def sizes(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> list[Finding]:
    """Columns that move far more or far less than declared, as they would not in another unit."""
    found = []
    converted = converted_units(trajectories)
    for channel, size, declared in _sizes(simulator, trajectories):
        times = size / declared
        if not times > 0.0 or 1 / FAR < times < FAR:
            continue
        units, most = other_units(channel.unit), _most(channel, declared)
        near = [
            *(f"`unit: {n}`" for n, unit in units if 1 / NEAR <= times * unit.factor <= most),
            *(f"`unit: {channel.unit}` in place of {n}" if channel.name in converted
              else f"`scale: {1 / unit.factor:g}`"
              for n, unit in units
              if converted.get(channel.name, n) == n and 1 / NEAR <= times / unit.factor <= most),
        ]  # fmt: skip
        if near:
            says = (
                f"has a size of {size:.3g}{channel.unit_text}, where "
                f"{declared:.3g}{channel.unit_text} are declared: if it counts otherwise "
                f"than read, set {' or '.join(near[:3])}"
            )
            found.append(Finding("size", channel.name, says, {"times": times}, "warning"))
    return found


def other_zero(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> list[Finding]:
    """Temperatures of the log that are those of another zero, beside what the simulator knows of,
    and what it knows of that is, beside those of the log."""
    columns = [
        *measured(simulator, trajectories),
        *(
            (channel, [run.actions[:, column] for run in trajectories])
            for column, channel in enumerate(simulator.action_channels)
        ),
    ]
    ends: dict[str, list[tuple[float, str]]] = {"K": [], "degC": []}
    for channel, runs in columns:
        known = _known(runs)
        if channel.unit in ends and known.size:
            ends[channel.unit] += [(float(known.max()), channel.name)]
    warm = {
        unit: [
            (float(np.max(parameter.value)), name)
            for name, parameter in simulator.parameters.items()
            if parameter.unit == unit and float(np.max(parameter.value)) > COLD
        ]
        for unit in ends
    }
    found = []
    for most, where in ends["K"] if warm["K"] else ():
        value, name = max(warm["K"])
        if most < COLD:
            says = (
                f"is never warmer than {most:.3g} K, where {name} is {value:.3g} K: if the column "
                "counts from 0 degC, set `unit: degC`"
            )
            found.append(Finding("size", where, says, {"most": most}, "warning"))
    hottest, where = max(ends["degC"], default=(np.inf, ""))
    for value, name in warm["degC"]:
        if hottest < COLD and OUTSIDE[0] <= value - ZERO <= OUTSIDE[1]:
            says = (
                f"is {value:.5g} degC in the simulator, where {where} is never warmer than "
                f"{hottest:.3g} degC: if that is in K, it is {value - ZERO:.3g} degC"
            )
            found.append(Finding("size", name, says, {"most": hottest}, "warning"))
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
        declared = channel.scale
        if declared == UNDECLARED:
            declared = max(_bounds(channel), default=0.0)
        size = float(
            np.abs(_known([run.actions[:, column] for run in trajectories])).max(initial=0.0)
        )
        if 0.0 < size < declared:
            yield channel, size, declared


def _known(runs: Sequence[Array]) -> Array:
    values = np.concatenate(list(runs))
    return values[np.isfinite(values)]


def _bounds(channel: Channel) -> list[float]:
    """Sizes of the bounds that a channel has."""
    return [abs(bound) for bound in (channel.low, channel.high) if np.isfinite(bound)]


def _most(channel: Channel, declared: float) -> float:
    """How many times the declared size a channel may have in another unit: an input no more than
    its bounds."""
    bounds = _bounds(channel)
    return ROUNDED * max(bounds) / declared if channel.kind == "input" and bounds else NEAR
