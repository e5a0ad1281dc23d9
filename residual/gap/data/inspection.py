"""What can be read off measured runs alone: one function for each kind of finding."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.other_clock import other_clock
from residual.logs.checks import Finding
from residual.logs.clipped import clipped_samples
from residual.logs.derived import differenced, summed_up
from residual.logs.faults import dropped_samples, rounding, wild_samples
from residual.logs.frozen import frozen_samples
from residual.trajectories import Trajectory, moment
from sims.host import HostSimulator
from sims.simulator import Channel

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# One sample in more control periods than these should be known.
_SLOW = 4.0
# Units of what can rub.
_SPEEDS = {
    "rad/s", "deg/s", "rev/s", "rpm", "rev/min", "1/min", "m/s", "cm/s", "mm/s", "km/h", "mph",
}  # fmt: skip
# What is easily taken for a unit.
_MISREAD = {"rad": "deg", "rad/s": "deg/s", "m": "mm", "m/s": "km/h", "A": "mA", "N m": "mN m",
            "1": "%", "kW": "W"}  # fmt: skip
# An input is in another unit if it goes beyond its bounds by this factor, or if it mostly does so.
_FAR_BEYOND = 3.0
# No more than this share of them are accidents.
_FEW_WILD = 0.01


def sampling(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> list[Finding]:
    """Samples much rarer than the control period, or as if minutes were seconds."""
    period = float(np.median(np.concatenate([run.durations for run in trajectories])))
    numbers = {"period_s": period, "control_period_s": simulator.dt}
    if otherwise := other_clock(period / simulator.dt):
        says = (
            f"a sample every {period:.4g} s, beside a control period of {simulator.name} of "
            f"{simulator.dt:g} s: {otherwise}"
        )
        return [Finding("sampling", "", says, numbers, "warning")]
    if period <= _SLOW * simulator.dt:
        return []
    driven = any(np.ptp(run.actions, axis=0).any() for run in trajectories if run.actions.size)
    unknown = "what the input did between samples is not known, and " if driven else ""
    says = (
        f"a sample every {period:.4g} s, {period / simulator.dt:.0f} control periods of "
        f"{simulator.name} ({simulator.dt:g} s): {unknown}fast effects cannot show; log at the "
        "control period if you can"
    )
    return [Finding("sampling", "", says, numbers, "warning")]


def bounds(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> list[Finding]:
    """Inputs beyond the bounds of their actuators, which a simulator would cut without a word."""
    found = []
    for column, channel in enumerate(simulator.action_channels):
        low, high = channel.low, channel.high
        room = 1e-6 * max(abs(bound) for bound in (low, high, 1e-300) if np.isfinite(bound))
        total, beyond = 0, 0
        rows: list[tuple[str, float]] = []
        most = 0.0
        for run in trajectories:
            values = run.actions[:, column]
            outside = (values < low - room) | (values > high + room)
            total, beyond = total + len(values), beyond + int(outside.sum())
            rows += [(run.name, float(t)) for t in run.times[:-1][outside]]
            if outside.any():
                most = max((most, *values[outside].tolist()), key=abs)
        if not beyond:
            continue
        bounds = f"{low:g} to {high:g}{channel.unit_text}"
        reaches = f"reaches {most:.4g}{channel.unit_text}, beyond the actuator's bounds of {bounds}"
        size = max(abs(bound) for bound in (low, high) if np.isfinite(bound))
        if abs(most) > _FAR_BEYOND * size or beyond > 0.5 * total:
            few = beyond <= max(1, _FEW_WILD * total)
            every = [run.actions[:, column] for run in trajectories]
            turned = all(((-v >= low - room) & (-v <= high + room)).all() for v in every)
            says = f"{reaches}, in {beyond} of {total} samples{_first(rows)}: " + (
                "no such command can have been meant; leave those cells empty"
                if few
                else "the other sign (`scale: -1`)"
                if turned
                else f"another unit ({_misread(channel.unit)}) or column, or bounds of the "
                f"simulator's channel {channel.name!r} that are not the actuator's"
            )
            found.append(refusal("bounds", channel.name, says))
            continue
        says = (
            f"{reaches}, in {beyond} of {total} samples{_first(rows)}; the simulator cuts it there"
        )
        numbers = {"samples": beyond, "most": most}
        found.append(Finding("bounds", channel.name, says, numbers, "warning", tuple(rows)))
    return found


def _misread(unit: str) -> str:
    """An example of a unit that is easily taken for this one."""
    return f"{_MISREAD[unit]} for {unit}" if unit in _MISREAD else "mV for V"


def speeds(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> list[Finding]:
    """Speeds that the simulator does not declare as such, so that nothing is taken to rub."""
    found = []
    for channel, _ in measured(simulator, trajectories):
        if channel.kind == "other" and channel.unit in _SPEEDS:
            says = (
                f'in {channel.unit} is a channel of kind "other", for which neither friction nor '
                "drag can be missing: if it is the speed of something, declare "
                f'Channel("{channel.name}", "{channel.unit}", "rate")'
            )
            found.append(Finding("undeclared", channel.name, says))
    return found


def still(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> list[Finding]:
    """Channels that never change."""
    found, moving = [], 0
    for channel, runs in measured(simulator, trajectories):
        values = np.concatenate(runs)
        values = values[np.isfinite(values)]
        if np.ptp(values) > 0:
            moving += 1
            continue
        says = (
            f"is {values[0]:g}{channel.unit_text} in all {len(values)} samples: not connected, "
            "frozen, or at rest throughout; it is taken as not measured"
        )
        found.append(Finding("still", channel.name, says, {"value": values[0]}, "warning"))
    if not moving:
        says = "no measured channel ever changes: nothing can be learnt from a system at rest"
        return [refusal("still", "", says)]
    return found


def faults(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> list[Finding]:
    """Samples that cannot be true."""
    found = []
    total = sum(len(run.times) for run in trajectories)
    for channel, masks in faulty(simulator, trajectories):
        for kind, words in _WORDS.items():
            rows = _rows(trajectories, masks[kind])
            if rows:
                says = f"{len(rows)} of {total} samples {words}{_first(rows)}; taken as missing"
                numbers = {"samples": len(rows)}
                found.append(Finding(kind, channel.name, says, numbers, "warning", rows))
    return found


def clipped(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> list[Finding]:
    """Channels that stay at the end of what they reach."""
    found = []
    for channel, runs in measured(simulator, trajectories):
        masks = clipped_samples(runs)
        rows = _rows(trajectories, masks)
        if rows:
            inside = np.concatenate([values[m] for values, m in zip(runs, masks, strict=True)])
            every = np.concatenate(runs)
            upper = inside > (np.nanmin(every) + np.nanmax(every)) / 2
            sides = [side for side in (inside[~upper], inside[upper]) if side.size]
            ends = " and ".join(f"{np.median(side):.4g}" for side in sides)
            says = (
                f"{len(rows)} samples stay at {ends}{channel.unit_text}, the end of all values, "
                "and come and go in full motion or are more in a row than noise leaves"
                f"{_first(rows)}: a sensor at the end of its range, "
                "or a stop. If the sensor, leave those cells empty: they count as measured here"
            )
            numbers = {"samples": len(rows)}
            found.append(Finding("clipped", channel.name, says, numbers, "warning", rows))
    return found


def rounded(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> list[Finding]:
    """Channels that were rounded by more than they change between samples."""
    found = []
    for channel, runs in measured(simulator, trajectories):
        step = rounding(runs)
        if step:
            says = (
                f"was rounded to steps of {step:.4g}{channel.unit_text}, which alone is a noise of "
                f"{step / np.sqrt(12):.2g}{channel.unit_text}"
            )
            found.append(Finding("rounded", channel.name, says, {"step": step}))
    return found


def sums(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> list[Finding]:
    """Channels that were computed from another one: its running sum, or its rate."""
    durations = [run.durations for run in trajectories]
    states = measured(simulator, trajectories)
    inputs = [
        (channel, [np.append(run.actions[:, j], np.nan) for run in trajectories])
        for j, channel in enumerate(simulator.action_channels)
    ]
    found = []
    for channel, values in states:
        for other, rates in (*states, *inputs):
            summable = other.unit == f"{channel.unit}/s" and other is not channel
            if not summable or channel.integrates == other.name:
                continue
            if other.rate_of == channel.name and differenced(values, rates, durations):
                says = (
                    f"was computed from differences of {channel.name}, and is no measurement of "
                    "its own; it is taken as not measured"
                )
                found.append(Finding("derived", other.name, says, {}, "warning"))
            elif summed_up(values, rates, durations):
                says = (
                    f"is the running sum of {other.name}, noise included, so that one of the two "
                    "is no measurement of its own. If it was summed up, its error grows with time: "
                    f"declare it by integrates={other.name!r} on its channel. If {other.name} was "
                    "computed from it, leave that out of the log's columns"
                )
                found.append(Finding("integral", channel.name, says, {}, "warning"))
    return found


def measured(
    simulator: HostSimulator, trajectories: Sequence[Trajectory]
) -> list[tuple[Channel, list[Array]]]:
    """Every channel that was measured, with its values in every run."""
    columns = [
        (channel, [run.states[:, j] for run in trajectories])
        for j, channel in enumerate(simulator.physical_channels)
    ]
    return [(c, runs) for c, runs in columns if any(np.isfinite(v).any() for v in runs)]


#: What the samples marked by each test are, in words.
_WORDS = {
    "dropped": "are one and the same value far from all others, as if the sensor had dropped out",
    "wild": "stand alone far from both neighbours",
    "frozen": "repeat the one before amid motion or noise, as if the sensor had frozen",
}


def faulty(
    simulator: HostSimulator, trajectories: Sequence[Trajectory]
) -> list[tuple[Channel, dict[str, list[Mask]]]]:
    """Samples that cannot be true: for every measured channel masks by kind, one for each run."""
    names = [channel.name for channel in simulator.physical_channels]
    rates = {c.rate_of: names.index(c.name) for c in simulator.physical_channels if c.rate_of}
    found = []
    for channel, runs in measured(simulator, trajectories):
        moved = None
        if channel.name in rates:
            moved = [run.states[:-1, rates[channel.name]] * run.durations for run in trajectories]
        dropped = dropped_samples(runs, 2 * np.pi if channel.angle else 0.0)
        wild = [a & ~b for a, b in zip(wild_samples(runs), dropped, strict=True)]
        frozen = frozen_samples(runs, moved)
        found.append((channel, {"dropped": dropped, "wild": wild, "frozen": frozen}))
    return found


def _rows(
    trajectories: Sequence[Trajectory], masks: Sequence[Mask]
) -> tuple[tuple[str, float], ...]:
    """Run and time of every marked sample."""
    return tuple(
        (run.name, float(time))
        for run, mask in zip(trajectories, masks, strict=True)
        for time in run.times[mask]
    )


def _first(rows: Sequence[tuple[str, float]]) -> str:
    name, time = rows[0]
    return f" (the first at {moment(time)} of {name})"


def refusal(kind: str, where: str, says: str) -> Finding:
    """A finding after which no answer could mean anything."""
    return Finding(kind, where, says, severity="refuse")
